"""What a port needs of the motor at its other end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from calib.motor.servo import MotorState


class Device(Protocol):
    """An `Emulator`, or one with faults around it."""

    @property
    def clock(self) -> Callable[[], float]:
        """Where its time comes from."""

    @property
    def connected(self) -> bool:
        """False once the cable is lost."""

    @property
    def baud(self) -> int:
        """The rate it listens and answers at, bits a second."""

    @property
    def reply_delay_s(self) -> float:
        """Time between the last instruction and the start of its answer."""

    @property
    def state(self) -> MotorState:
        """What the motor truly does now."""

    @property
    def stopped(self) -> bool:
        """True where it is not being driven."""

    def feed(self, data: bytes, baud: int | None = None) -> bytes:
        """Hears bytes and answers."""
