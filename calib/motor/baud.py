"""Baud rates of the motor, and what one end hears when the other speaks at another rate."""

from __future__ import annotations

from random import Random

BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""By the value of Baud Rate (8); ROBOTIS e-manual, XW540-T140-R. 57,600 is the factory setting."""

TOLERANCE = 0.03
"""Share by which two ends may differ and still understand each other (e-manual, Baud Rate)."""


def same_baud(one: int, other: int) -> bool:
    """True where two ends at these rates understand each other."""
    return abs(one - other) <= TOLERANCE * other


def heard(data: bytes, sent_baud: int, read_baud: int, noise: Random) -> bytes:
    """What arrives at `read_baud` of bytes sent at `sent_baud`: themselves, or about as much noise as time allows."""
    if same_baud(sent_baud, read_baud):
        return data
    return noise.randbytes(round(len(data) * read_baud / sent_baud)) if len(data) < 4096 else b""


def baud_setting(baud: int) -> int:
    """The value of Baud Rate (8) for a rate in bits a second.

    Raises:
        ValueError: if the motor does not know the rate.
    """
    if baud not in BAUD_RATES:
        choices = ", ".join(f"{rate:_}" for rate in BAUD_RATES)
        raise ValueError(f"baud rate {baud!r}: the motor knows {choices}; choose one of them")
    return BAUD_RATES.index(baud)
