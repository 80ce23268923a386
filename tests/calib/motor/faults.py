"""Faults between host and motor, and in the motor, drawn by seed."""

from dataclasses import dataclass
from enum import StrEnum
from random import Random
from typing import Any

from calib.motor import Emulator, HardwareError


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
    WRONG_BAUD = "wrong_baud"
    POWER_CYCLE = "power_cycle"
    INPUT_VOLTAGE = "input_voltage"
    OVERHEATING = "overheating"
    ENCODER = "encoder"
    ELECTRICAL_SHOCK = "electrical_shock"
    OVERLOAD = "overload"


ALL_FAULTS = tuple(Fault)
LATEST_S = 0.2
WRONG_RATE = 57_600, 115_200


@dataclass(frozen=True)
class Faults:
    """Which faults come, and how often: a share `rate` of the exchanges with bytes in them, after the first `after`.

    `DISCONNECT`, `WRONG_BAUD` and the hardware errors last; the others cost the one exchange. The same seed and the
    same bytes give the same faults.
    """

    seed: int = 0
    kinds: tuple[Fault, ...] = ALL_FAULTS
    rate: float = 0.02
    after: int = 0


def power_cycle(motor: Emulator) -> None:
    """Takes its power away for a moment: RAM is lost, torque is off, errors and whole turns are forgotten."""
    _ = motor.state
    motor._servo.restart()
    motor._reader.clear()


class FaultyEmulator(Emulator):
    """A motor with faults around it. `happened` lists (exchange, fault).

    Args:
        faults: that come.
        settings: of the `Emulator`.
    """

    def __init__(self, faults: Faults, **settings: Any) -> None:
        super().__init__(**settings)
        self.faults = faults
        self.happened: list[tuple[int, Fault]] = []
        self._chance = Random(faults.seed)
        self._exchanges = 0
        self._late_s = 0.0
        self._line_baud: int | None = None

    @property
    def reply_delay_s(self) -> float:
        """Time between the last instruction and the start of its answer."""
        return super().reply_delay_s + self._late_s

    def feed(self, data: bytes, baud: int | None = None) -> bytes:
        """Hears bytes and answers, unless a fault says otherwise."""
        if not self.connected:
            return b""
        fault = self._draw() if data else None
        self._late_s = self._chance.uniform(0, LATEST_S) if fault is Fault.REPLY_LATE else 0.0
        self._strike(fault)
        if not self.connected:
            return b""
        reply = super().feed(self._on_the_way(data, fault), self._line_baud or baud)
        return self._on_the_way_back(reply, fault)

    def _draw(self) -> Fault | None:
        """The fault of this exchange, if any."""
        self._exchanges += 1
        strikes, kind = self._chance.random() < self.faults.rate, self._chance.choice(self.faults.kinds)
        if not strikes or self._exchanges <= self.faults.after:
            return None
        self.happened.append((self._exchanges, kind))
        return kind

    def _strike(self, fault: Fault | None) -> None:
        """Faults of the motor, the cable and the line as a whole."""
        if fault is None:
            return
        if fault.name in HardwareError.__members__:
            self.raise_error(HardwareError[fault.name])
        elif fault is Fault.POWER_CYCLE:
            power_cycle(self)
        elif fault is Fault.DISCONNECT:
            self.connected = False
        elif fault is Fault.WRONG_BAUD:
            self._line_baud = next(rate for rate in WRONG_RATE if rate != self.baud)

    def _on_the_way(self, data: bytes, fault: Fault | None) -> bytes:
        if fault is Fault.REQUEST_LOST:
            return b""
        return self._flip_a_bit(data) if fault is Fault.REQUEST_CORRUPTED else data

    def _on_the_way_back(self, reply: bytes, fault: Fault | None) -> bytes:
        if fault is Fault.REPLY_LOST:
            return b""
        if fault is Fault.REPLY_CUT:
            return reply[: self._chance.randrange(len(reply))] if reply else b""
        if fault is Fault.GARBAGE:
            noise = self._chance.randbytes(self._chance.randint(1, 40))
            return noise + reply if self._chance.random() < 0.5 else noise
        return self._flip_a_bit(reply) if fault is Fault.REPLY_CORRUPTED else reply

    def _flip_a_bit(self, data: bytes) -> bytes:
        if not data:
            return data
        at = self._chance.randrange(len(data))
        return data[:at] + bytes([data[at] ^ 1 << self._chance.randrange(8)]) + data[at + 1 :]
