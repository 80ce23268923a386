"""What the motor is told in a trial, step by step: the schedule of `calib capture`, which must run without this."""

from typing import NamedTuple

START_CODE = (1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, -1, 1, 1, -1, -1)
CHIP_S, CHIP_TURNS_PER_S = 0.25, 0.25
REST_S, RUN_OUT_S = 0.5, 1.0


class Step(NamedTuple):
    """A speed held for a time.

    Attributes:
        part: "rest", "start_code", "drive" or "end_code".
        turns_per_s: crank turns a second.
        seconds: how long.
    """

    part: str
    turns_per_s: float
    seconds: float


def schedule(hz: float, seconds: float) -> tuple[Step, ...]:
    """Rest, start code, rest, drive, run-out, end code (the start code backwards), rest.

    Args:
        hz: crank turns a second of the drive.
        seconds: how long it is driven.
    """
    rest = Step("rest", 0.0, REST_S)
    start, end = (
        [Step(part, chip * CHIP_TURNS_PER_S, CHIP_S) for chip in chips]
        for part, chips in (("start_code", START_CODE), ("end_code", START_CODE[::-1]))
    )
    return (rest, *start, rest, Step("drive", hz, seconds), Step("rest", 0.0, RUN_OUT_S), *end, rest)
