"""How a session is worked on."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from fitting import Comparison, MethodName
from fitting.coefficients import FULL, QUICK
from tracking.tracker import TrackerName

EffortName = Literal["quick", "full"]
EFFORTS = {"quick": QUICK, "full": FULL}
Tell = Callable[[str, float | None], None]
"""Called with what is going on and the share done, None when unknown."""


def _silent(_message: str, _share: float | None) -> None:
    return


@dataclass(frozen=True)
class Options:
    """How a session is worked on.

    Attributes:
        effort: "quick" or "full".
        workers: threads; 0 for all cores.
        method: the search, see `fitting.methods`; None: that of the calibration which stands, else gradient.
        comparison: what it minimises, see `fitting.Swims`; None: as in the calibration which stands, else published.
        tracker: see `tracking.tracker.TRACKERS`; None: that of the tracks which stand there, else hybrid.
        tell: receives progress.
    """

    effort: EffortName = "full"
    workers: int = 0
    method: MethodName | None = None
    comparison: Comparison | None = None
    tracker: TrackerName | None = None
    tell: Tell = field(default=_silent)

    def telling(self, tell: Tell) -> "Options":
        """The same options with another receiver of progress."""
        return replace(self, tell=tell)
