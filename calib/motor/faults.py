"""Faults between host and motor, and in the motor, drawn by seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from random import Random
from typing import NamedTuple

from calib.motor.control_table import ControlTable
from calib.motor.emulator import Emulator
from calib.motor.servo import HardwareError, MotorState


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


class TimedFault(NamedTuple):
    """A fault that comes with the first exchange so many seconds after the very first one, or later."""

    kind: Fault
    time_s: float


@dataclass(frozen=True)
class Faults:
    """Which faults come, and how often: a share `rate` of the exchanges with bytes in them, after the first `after`.

    Those of `timed` come besides, each once. `DISCONNECT`, `WRONG_BAUD` and the hardware errors last; the others cost
    the one exchange. The same seed and the same bytes give the same faults.
    """

    seed: int = 0
    kinds: tuple[Fault, ...] = ALL_FAULTS
    rate: float = 0.02
    after: int = 0
    timed: tuple[TimedFault, ...] = ()

    def __post_init__(self) -> None:
        if not self.kinds or not 0 <= self.rate <= 1 or self.after < 0:
            raise ValueError(f"{self}: expected one kind or more, a rate from 0 to 1, and `after` of 0 or more")
        if any(not time_s >= 0 for _, time_s in self.timed):
            raise ValueError(f"{self}: expected timed faults at 0 s or later")


class FaultyEmulator:
    """A motor with faults around it; everything else is as in `Emulator`. `happened` lists (exchange, fault)."""

    def __init__(self, emulator: Emulator, faults: Faults) -> None:
        self.emulator = emulator
        self.faults = faults
        self.connected = True
        self.happened: list[tuple[int, Fault]] = []
        self._random = Random(faults.seed)
        self._exchanges = 0
        self._first_s: float | None = None
        self._timed = sorted(faults.timed, key=lambda timed: timed.time_s, reverse=True)  # the next one last
        self._late_s = 0.0
        self._line_baud: int | None = None

    @property
    def clock(self) -> Callable[[], float]:
        """Where its time comes from."""
        return self.emulator.clock

    @property
    def id(self) -> int:
        """Its address on the bus."""
        return self.emulator.id

    @property
    def baud(self) -> int:
        """The rate the motor listens and answers at, bits a second."""
        return self.emulator.baud

    @property
    def table(self) -> ControlTable:
        """The motor's control table."""
        return self.emulator.table

    @property
    def reply_delay_s(self) -> float:
        """Time between the last instruction and the start of its answer."""
        return self.emulator.reply_delay_s + self._late_s

    @property
    def state(self) -> MotorState:
        """What the motor truly does now."""
        return self.emulator.state

    @property
    def stopped(self) -> bool:
        """True where it is not being driven."""
        return self.emulator.stopped

    def feed(self, data: bytes, baud: int | None = None) -> bytes:
        """Hears bytes and answers, unless a fault says otherwise."""
        if not self.connected:
            return b""
        fault = self._draw() if data else None
        self._late_s = self._random.uniform(0, LATEST_S) if fault is Fault.REPLY_LATE else 0.0
        self._strike(fault)
        if not self.connected:
            return b""
        reply = self.emulator.feed(self._on_the_way(data, fault), self._line_baud or baud)
        return self._on_the_way_back(reply, fault)

    def _draw(self) -> Fault | None:
        """The fault of this exchange, if any."""
        self._exchanges += 1
        strikes, kind = self._random.random() < self.faults.rate, self._random.choice(self.faults.kinds)
        if self._is_due():
            kind = self._timed.pop().kind
        elif not strikes or self._exchanges <= self.faults.after:
            return None
        self.happened.append((self._exchanges, kind))
        return kind

    def _is_due(self) -> bool:
        """True where the time of the next timed fault has come."""
        now = self.clock()
        self._first_s = now if self._first_s is None else self._first_s
        return bool(self._timed) and now - self._first_s >= self._timed[-1].time_s

    def _strike(self, fault: Fault | None) -> None:
        """Faults of the motor, the cable and the line as a whole."""
        if fault is None:
            return
        if fault.name in HardwareError.__members__:
            self.emulator.raise_error(HardwareError[fault.name])
        elif fault is Fault.POWER_CYCLE:
            self.emulator.power_cycle()
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
            return reply[: self._random.randrange(len(reply))] if reply else b""
        if fault is Fault.GARBAGE:
            noise = self._random.randbytes(self._random.randint(1, 40))
            return noise + reply if self._random.random() < 0.5 else noise
        return self._flip_a_bit(reply) if fault is Fault.REPLY_CORRUPTED else reply

    def _flip_a_bit(self, data: bytes) -> bytes:
        if not data:
            return data
        at = self._random.randrange(len(data))
        return data[:at] + bytes([data[at] ^ 1 << self._random.randrange(8)]) + data[at + 1 :]
