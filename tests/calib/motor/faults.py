"""Faults between host and motor, and in the motor, drawn by seed."""

from dataclasses import dataclass
from enum import StrEnum
from random import Random
from typing import Any

from calib.capture.emulator import EEPROM_END, MotorEmulator


class Fault(StrEnum):
    """What can go wrong with one exchange, or from one exchange on."""

    REQUEST_LOST = "request_lost"
    REQUEST_CORRUPTED = "request_corrupted"
    REPLY_LOST = "reply_lost"
    REPLY_CORRUPTED = "reply_corrupted"
    REPLY_CUT = "reply_cut"
    REPLY_LATE = "reply_late"
    GARBAGE = "garbage"
    DISCONNECT = "disconnect"
    SILENCE = "silence"
    POWER_CYCLE = "power_cycle"
    INPUT_VOLTAGE = "input_voltage"
    OVERLOAD = "overload"


ALL_FAULTS = tuple(Fault)
INPUT_VOLTAGE, OVERLOAD = 1, 32  # bits of Hardware Error Status (70)
LATEST_S = 0.2


@dataclass(frozen=True)
class Faults:
    """Which faults come, and how often: a share `rate` of the exchanges with bytes in them, after the first `after`.

    `DISCONNECT`, `SILENCE` and the hardware errors last; the others cost the one exchange. The same seed and the same
    bytes give the same faults.
    """

    seed: int = 0
    kinds: tuple[Fault, ...] = ALL_FAULTS
    rate: float = 0.02
    after: int = 0


def raise_error(motor: MotorEmulator, error: int) -> None:
    """The motor finds a hardware error; an overload switches its torque off."""
    motor["hardware_error_status"] = error
    if error == OVERLOAD:
        motor["torque_enable"] = 0


def power_cycle(motor: MotorEmulator) -> None:
    """Takes its power away for a moment: what is not in EEPROM is lost, torque is off, its clock starts anew."""
    fresh = MotorEmulator(clock=motor.clock)
    motor._memory[EEPROM_END:] = fresh._memory[EEPROM_END:]
    motor._started_at = motor.clock()


class FaultyEmulator(MotorEmulator):
    """A motor with faults around it. `happened` counts them; `settings` are those of the `MotorEmulator`."""

    def __init__(self, faults: Faults, **settings: Any) -> None:
        super().__init__(**settings)
        self.faults = faults
        self.happened = 0
        self._chance = Random(faults.seed)
        self._exchanges = 0
        self._silent = False

    def feed(self, data: bytes) -> bytes:
        """Hears bytes and answers, unless a fault says otherwise."""
        if not data or self._silent:
            return super().feed(b"")
        fault = self._draw()
        late_s = self._chance.uniform(0, LATEST_S) if fault is Fault.REPLY_LATE else 0.0
        self.reply_delay_s = MotorEmulator.reply_delay_s + late_s
        if fault in (Fault.INPUT_VOLTAGE, Fault.OVERLOAD):
            raise_error(self, INPUT_VOLTAGE if fault is Fault.INPUT_VOLTAGE else OVERLOAD)
        elif fault is Fault.POWER_CYCLE:
            power_cycle(self)
        elif fault in (Fault.DISCONNECT, Fault.SILENCE):
            self._silent = True
            self.connected = self.connected and fault is Fault.SILENCE
        if self._silent or fault is Fault.REQUEST_LOST:
            return b""
        reply = super().feed(self._flip_a_bit(data) if fault is Fault.REQUEST_CORRUPTED else data)
        return self._on_the_way_back(reply, fault)

    def _draw(self) -> Fault | None:
        """The fault of this exchange, if any."""
        self._exchanges += 1
        strikes, kind = self._chance.random() < self.faults.rate, self._chance.choice(self.faults.kinds)
        if not strikes or self._exchanges <= self.faults.after:
            return None
        self.happened += 1
        return kind

    def _on_the_way_back(self, reply: bytes, fault: Fault | None) -> bytes:
        match fault:
            case Fault.REPLY_LOST:
                return b""
            case Fault.REPLY_CUT:
                return reply[: self._chance.randrange(len(reply) + 1)]
            case Fault.GARBAGE:
                noise = self._chance.randbytes(self._chance.randint(1, 40))
                return noise + reply if self._chance.random() < 0.5 else noise
            case Fault.REPLY_CORRUPTED if reply:
                return self._flip_a_bit(reply)
        return reply

    def _flip_a_bit(self, data: bytes) -> bytes:
        at = self._chance.randrange(len(data))
        return data[:at] + bytes([data[at] ^ 1 << self._chance.randrange(8)]) + data[at + 1 :]
