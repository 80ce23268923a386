"""Mechanisms that go on from one trial of a session to the next: what slackens, slips or breaks does not mend."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from benchmarks.reality.mechanism import Mechanism


@dataclass(frozen=True, kw_only=True)
class Wearing(Mechanism):
    """Begins where the trials before left it.

    Attributes:
        before_s: that the robot has been in use in this session before the first frame.
    """

    before_s: float = 0.0


def worn(mechanisms: Iterable[Mechanism], before_s: float) -> tuple[Mechanism, ...]:
    """The same after a time in use, s; those that do not wear stay as they are."""
    return tuple(replace(each, before_s=before_s) if isinstance(each, Wearing) else each for each in mechanisms)
