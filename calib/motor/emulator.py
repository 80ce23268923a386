"""An emulated XW540-T140-R: bytes in, bytes out, with a motor behind them and a clock of the caller's choice.

Sources: ROBOTIS e-manual, "Protocol 2.0" and "XW540-T140-R". Not emulated: the position, current and PWM modes (the
motor holds), indirect addresses, backup, fast and bulk instructions, torque on by goal update.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from random import Random

from calib.motor.baud import BAUD_RATES, baud_setting, heard
from calib.motor.control_table import Refused
from calib.motor.motor_physics import Load, MotorConstants, MotorPhysics
from calib.motor.protocol import (
    ALERT,
    BROADCAST_ID,
    MAX_ID,
    ErrorNumber,
    Instruction,
    Packet,
    PacketReader,
    encode_status,
)
from calib.motor.servo import HardwareError, MotorState, Servo

PACKET_TIMEOUT_S = 0.1
"""A packet that stays unfinished for so long is forgotten (assumed)."""
LEAST_LEVEL: dict[int, int] = {Instruction.PING: 0, Instruction.READ: 1, Instruction.SYNC_READ: 1}
"""The Status Return Level (68) from which an instruction is answered; 2 for the others."""


class Emulator:
    """One motor on a bus of its own.

    `clock` gives seconds and never runs backwards: `time.monotonic`, or a `VirtualClock` to run hours in seconds.
    `load` is friction in N m or a function (angle_rad, velocity_rad_s) -> torque against positive turning.
    `seed` draws the angle it starts at, its tick, and the ripple of the current. It starts as from the factory, but at
    `baud`; 57,600 is the factory's. `table` is there to look into. Safe to ask from several threads.
    """

    def __init__(
        self,
        id: int = 1,  # noqa: A002
        clock: Callable[[], float] = time.monotonic,
        load: Load = 0.0,
        seed: int = 0,
        baud: int = 1_000_000,
        constants: MotorConstants | None = None,
    ) -> None:
        if not 0 <= id <= MAX_ID:
            raise ValueError(f"motor id {id}: expected a number from 0 to {MAX_ID}")
        self.connected = True
        self._random = Random(seed)
        physics = MotorPhysics(constants or MotorConstants(), load, self._random.uniform(0, 2 * math.pi))
        self._servo = Servo(physics, clock, self._random)
        self.table = self._servo.table
        self.table["id"], self.table["baud_rate"] = id, baud_setting(baud)
        self._reader = PacketReader()
        self._bytes_at = clock()
        self._registered: bytes | None = None
        self._lock = threading.RLock()
        self._answers: dict[int, Callable[[bytes], bytes | None]] = {
            Instruction.PING: self._ping,
            Instruction.READ: self._read,
            Instruction.WRITE: self._write,
            Instruction.REG_WRITE: self._register,
            Instruction.ACTION: self._action,
            Instruction.FACTORY_RESET: self._factory_reset,
            Instruction.REBOOT: self._reboot,
            Instruction.CLEAR: self._clear,
            Instruction.SYNC_READ: self._sync_read,
            Instruction.SYNC_WRITE: self._sync_write,
        }

    @property
    def clock(self) -> Callable[[], float]:
        """Where its time comes from."""
        return self._servo.clock

    @property
    def id(self) -> int:
        """Its address on the bus."""
        return self.table["id"]

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

    def set_supply(self, volts: float) -> None:
        """Sets the voltage at its terminals; outside its limits it raises the input voltage error."""
        with self._lock:
            self._servo.advance()
            self._servo.physics.supply_v = volts

    def raise_error(self, error: HardwareError) -> None:
        """Raises a hardware error, as if the motor had found it; those in Shutdown (63) switch its torque off."""
        with self._lock:
            self._servo.advance()
            self._servo.raise_error(error)

    def power_cycle(self) -> None:
        """Takes its power away for a moment: RAM is lost, torque is off, errors and whole turns are forgotten."""
        with self._lock:
            self._servo.advance()
            self._restart()

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
            packets = self._reader.push(heard(data, host, own, self._random))
            return heard(b"".join(map(self._hear, packets)), own, host, self._random)

    def _hear(self, packet: Packet) -> bytes:
        """Obeys one packet; its answer, or no bytes."""
        own = self.id
        if not self._servo.ready or packet.instruction == Instruction.STATUS:
            return b""
        if not packet.intact:
            return self._status(packet, ErrorNumber.CRC) if packet.id == own else b""
        self._servo.heard_at = self._servo.now
        if packet.id not in (own, BROADCAST_ID, self.table["secondary_id"]):
            return b""
        answer = self._answers.get(packet.instruction, self._unknown)
        try:
            params = answer(packet.params)
        except Refused as refusal:
            return self._status(packet, refusal.number)
        return b"" if params is None else self._status(packet, ErrorNumber.NONE, params)

    def _status(self, packet: Packet, number: ErrorNumber, params: bytes = b"") -> bytes:
        """The answer, where Status Return Level (68) and the packet's id let it out."""
        level = LEAST_LEVEL.get(packet.instruction, 2)
        if packet.id == BROADCAST_ID:
            answered = packet.instruction in (Instruction.PING, Instruction.SYNC_READ)
        else:
            answered = packet.id != self.table["secondary_id"]
        if not answered or level > self.table["status_return_level"]:
            return b""
        alert = ALERT if self.table["hardware_error_status"] else 0
        return encode_status(self.id, alert | number, params)

    def _unknown(self, _: bytes) -> bytes:
        raise Refused(ErrorNumber.INSTRUCTION)

    def _ping(self, _: bytes) -> bytes:
        return self.table.read(0, 2) + self.table.read(6, 1)

    def _read(self, params: bytes) -> bytes:
        if len(params) != 4:
            raise Refused(ErrorNumber.DATA_LENGTH)
        self._servo.publish()
        return self.table.read(_number(params[:2]), _number(params[2:]))

    def _sync_read(self, params: bytes) -> bytes | None:
        """Answers only as the first of the list: on its bus no other motor speaks before it."""
        return self._read(params[:4]) if params[4:5] == bytes([self.id]) else None

    def _checked(self, params: bytes) -> dict[str, int]:
        if len(params) < 3:
            raise Refused(ErrorNumber.DATA_LENGTH)
        return self.table.check_write(_number(params[:2]), params[2:])

    def _write(self, params: bytes) -> bytes:
        self._servo.write(self._checked(params))
        return b""

    def _sync_write(self, params: bytes) -> None:
        length = _number(params[2:4])
        for start in range(4, len(params) - length, length + 1):
            if params[start] == self.id:
                self._write(params[:2] + params[start + 1 : start + 1 + length])

    def _register(self, params: bytes) -> bytes:
        self._checked(params)
        self._registered = params
        self.table["registered_instruction"] = 1
        return b""

    def _action(self, _: bytes) -> bytes:
        registered, self._registered = self._registered, None
        self.table["registered_instruction"] = 0
        if registered is None:
            raise Refused(ErrorNumber.INSTRUCTION)
        return self._write(registered)

    def _factory_reset(self, _: bytes) -> bytes:
        """Refused: nothing that runs a fish has a reason to ask for it."""
        raise Refused(ErrorNumber.RESULT_FAIL)

    def _reboot(self, _: bytes) -> bytes:
        self._restart()
        return b""

    def _restart(self) -> None:
        self._servo.restart()
        self._registered = None
        self._reader.clear()

    def _clear(self, params: bytes) -> bytes:
        """Forgets whole turns; only at rest."""
        if params != b"\x01\x44\x58\x4c\x22":
            raise Refused(ErrorNumber.DATA_RANGE)
        if self._servo.physics.velocity_rad_s:
            raise Refused(ErrorNumber.RESULT_FAIL)
        self._servo.forget_turns()
        return b""


def _number(raw: bytes) -> int:
    return int.from_bytes(raw, "little")
