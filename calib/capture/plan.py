"""The plan of one trial of the motor: a list of steps, each a speed held for a time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

START_CODE = (1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, -1, 1, 1, -1, -1)
END_CODE = START_CODE[::-1]

CHIP_S = 0.25
CHIP_TURNS_PER_S = 0.25


REST_S = 0.5
RUN_OUT_S = 1.0  # the crank comes to rest before the end code


class Step(NamedTuple):
    """A speed that is held for a time; `part` is "rest", "start_code", "drive" or "end_code"."""

    part: str
    turns_per_s: float
    seconds: float


@dataclass(frozen=True)
class TrialPlan:
    """One trial at `hz` crank turns a second: rest, start code, rest, drive, rest, end code, rest; codes if `coded`."""

    name: str
    hz: float
    seconds: float
    coded: bool = True

    def steps(self) -> Iterator[Step]:
        """Yield the steps in their order."""
        yield Step("rest", 0.0, REST_S)
        if self.coded:
            yield from _code("start_code", START_CODE)
            yield Step("rest", 0.0, REST_S)
        yield Step("drive", self.hz, self.seconds)
        yield Step("rest", 0.0, RUN_OUT_S)
        if self.coded:
            yield from _code("end_code", END_CODE)
            yield Step("rest", 0.0, REST_S)

    @property
    def total_s(self) -> float:
        """Duration of the whole trial, seconds."""
        return sum(step.seconds for step in self.steps())


def trial_name(hz: float, taken: Sequence[str]) -> str:
    """Name a trial after its speed, ``f0_60``, or ``f0_60_2`` where that is taken.

    Names that differ in case only count as one.
    """
    two = f"{hz:.2f}"
    name = "f" + (two if float(two) == hz else repr(hz)).replace(".", "_").replace("-", "m")
    used = {other.casefold() for other in taken}
    number = 2
    unique = name
    while unique.casefold() in used:
        unique, number = f"{name}_{number}", number + 1
    return unique


def _code(part: str, chips: Sequence[int]) -> Iterator[Step]:
    return (Step(part, chip * CHIP_TURNS_PER_S, CHIP_S) for chip in chips)
