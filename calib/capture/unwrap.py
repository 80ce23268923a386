"""Counters that wrap, made to go on."""

from __future__ import annotations


class Unwrapped:
    """A counter of `modulus` steps, followed over its wraps.

    Between two values it must move by less than half the modulus, either way.
    """

    def __init__(self, modulus: int) -> None:
        self._modulus = modulus
        self._total: int | None = None

    def follow(self, value: int) -> int:
        """The count that goes on from the one before; the first value is taken as it is."""
        if self._total is None:
            self._total = value
        else:
            half = self._modulus // 2
            self._total += (value - self._total + half) % self._modulus - half
        return self._total
