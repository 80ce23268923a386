"""An emulated XW540-T140-R: bytes in, bytes out, with a motor behind them and a clock of the caller's choice.

Sources: ROBOTIS e-manual, "Protocol 2.0" and "XW540-T140-R". It knows the instructions that `calib capture` sends:
ping, read and write. Not emulated: other modes than that of velocity (the motor holds), profiles of time, another id.
"""

import math
import threading
import time
from collections.abc import Callable
from random import Random

from calib.motor.control_table import Refusal
from calib.motor.motor_physics import MotorConstants, MotorPhysics
from calib.motor.protocol import (
    ALERT,
    BROADCAST_ID,
    ErrorNumber,
    Instruction,
    Packet,
    PacketReader,
    encode,
)
from calib.motor.servo import HardwareError, MotorState, Servo

BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""By the value of Baud Rate (8); ROBOTIS e-manual, XW540-T140-R. 57,600 is the factory setting."""
BAUD_TOLERANCE = 0.03
"""Share by which two ends may differ and still understand each other (e-manual, Baud Rate)."""
PACKET_TIMEOUT_S = 0.1
"""A packet that stays unfinished for so long is forgotten (assumed)."""


class Emulator:
    """One motor on a bus of its own.

    `clock` gives seconds and never runs backwards. `load_nm` is friction on the shaft. `seed` draws the angle it starts
    at, its tick, and the ripple of the current. It starts as from the factory, but at `baud`; 57,600 is the factory's.
    `table` is there to look into. Safe to ask from several threads.
    """

    def __init__(
        self,
        id: int = 1,  # noqa: A002
        clock: Callable[[], float] = time.monotonic,
        load_nm: float = 0.0,
        seed: int = 0,
        baud: int = 1_000_000,
    ) -> None:
        self.connected, self.clock = True, clock
        self._random = Random(seed)
        physics = MotorPhysics(MotorConstants(), load_nm, self._random.uniform(0, 2 * math.pi))
        self._servo = Servo(physics, clock, self._random)
        self.table = self._servo.table
        self.table["id"], self.table["baud_rate"] = id, BAUD_RATES.index(baud)
        self._reader = PacketReader()
        self._bytes_at = clock()
        self._lock = threading.RLock()

    @property
    def baud(self) -> int:
        """The rate it listens and answers at, bits a second."""
        return BAUD_RATES[self.table["baud_rate"]]

    @property
    def reply_delay_s(self) -> float:
        """Time between the end of an instruction and the start of its answer: Return Delay Time (9), 2 us a unit."""
        return self.table["return_delay_time"] * 2e-6

    @property
    def state(self) -> MotorState:
        """What the motor truly does now."""
        with self._lock:
            self._servo.advance()
            return self._servo.state

    @property
    def stopped(self) -> bool:
        """True where it is not being driven: torque off, or held at a speed of zero."""
        return self.state.goal_velocity_rad_s == 0.0

    def raise_error(self, error: HardwareError) -> None:
        """Raises a hardware error, as if the motor had found it; those in Shutdown (63) switch its torque off."""
        with self._lock:
            self._servo.advance()
            self._servo.raise_error(error)

    def feed(self, data: bytes, baud: int | None = None) -> bytes:
        """Hears bytes and answers: the status packets they ask for, in order; often none.

        `baud` is the rate the host speaks at; None is the motor's own. At another rate both hear noise. The answer
        starts `reply_delay_s` after the instruction's last byte: keeping that time is the caller's.
        """
        with self._lock:
            self._servo.advance()
            now, host, own = self._servo.now, baud or self.baud, self.baud
            if now - self._bytes_at > PACKET_TIMEOUT_S:
                self._reader.clear()
            self._bytes_at = now
            packets = self._reader.push(self._heard(data, host, own))
            return self._heard(b"".join(map(self._hear, packets)), own, host)

    def _heard(self, data: bytes, sent_baud: int, read_baud: int) -> bytes:
        """What arrives of bytes sent at another rate: themselves, or about as much noise as time allows."""
        if abs(sent_baud - read_baud) <= BAUD_TOLERANCE * read_baud:
            return data
        return self._random.randbytes(round(len(data) * read_baud / sent_baud)) if len(data) < 4096 else b""

    def _hear(self, packet: Packet) -> bytes:
        """Obeys one packet; its answer, or no bytes."""
        if not self._servo.ready or packet.instruction == Instruction.STATUS:
            return b""
        own = packet.id == self.table["id"]
        if not packet.intact:
            return self._status(ErrorNumber.CRC) if own else b""
        self._servo.heard_at = self._servo.now
        if not (own or packet.id == BROADCAST_ID):
            return b""
        try:
            answer = self._status(ErrorNumber.NONE, self._obey(packet))
        except Refusal as refusal:
            answer = self._status(refusal.number)
        return answer if own or packet.instruction == Instruction.PING else b""

    def _obey(self, packet: Packet) -> bytes:
        """The parameters of the answer."""
        params = packet.params
        match packet.instruction:
            case Instruction.PING:
                return self.table.read(0, 2) + self.table.read(6, 1)
            case Instruction.READ if len(params) == 4:
                self._servo.publish()
                return self.table.read(_number(params[:2]), _number(params[2:]))
            case Instruction.WRITE if len(params) > 2:
                self._servo.write(self.table.check_write(_number(params[:2]), params[2:]))
                return b""
            case Instruction.READ | Instruction.WRITE:
                raise Refusal(ErrorNumber.DATA_LENGTH)
            case _:
                raise Refusal(ErrorNumber.INSTRUCTION)

    def _status(self, number: ErrorNumber, params: bytes = b"") -> bytes:
        """A status packet: the error byte, with the alert where there is a hardware error, then the parameters."""
        alert = ALERT if self.table["hardware_error_status"] else 0
        return encode(Packet(self.table["id"], Instruction.STATUS, bytes([alert | number]) + params))


def _number(raw: bytes) -> int:
    return int.from_bytes(raw, "little")
