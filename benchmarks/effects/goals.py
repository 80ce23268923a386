"""What a diagnosis should reach."""

from collections.abc import Mapping
from typing import NamedTuple


class Goal(NamedTuple):
    """Of one share.

    Attributes:
        label: what is counted.
        low, high: within which it should be.
    """

    label: str
    low: float
    high: float

    @property
    def asked(self) -> str:
        """`≤ 1 %`, `≥ 85 %`, `92 to 98 %`."""
        if self.low == 0.0:
            return f"≤ {self.high:.0%}".replace("%", " %")
        if self.high == 1.0:
            return f"≥ {self.low:.0%}".replace("%", " %")
        return f"{100 * self.low:.0f} to {100 * self.high:.0f} %"


GOALS: Mapping[str, Goal] = {
    "false_alarms": Goal("alarm where there is nothing", 0.0, 0.01),
    "right_first": Goal("right name first, d ≥ 5", 0.85, 1.0),
    "right_in_three": Goal("right name among three, d ≥ 5", 0.90, 1.0),
    "confident_wrong": Goal("wrong name above 90 %", 0.0, 0.02),
    "unexplained_outside": Goal("outside: unexplained", 0.80, 1.0),
    "confident_outside": Goal("outside: a name above 90 %", 0.0, 0.05),
    "doubles_in_groups": Goal("two: each in its group", 0.70, 1.0),
    "stage_right": Goal("most of the gap on its stage", 0.80, 1.0),
    "interval_holds": Goal("interval holds the oracle's, d ≥ 5", 0.92, 0.98),
}
"""By the names of a score's headline; d is the detectability."""

CLEAR_ALONE: Mapping[str, str] = {
    "unexplained_outside": "outside: unexplained",
    "doubles_in_groups": "two: each in its group",
    "stage_right": "gap on its stage",
}
"""By the names of what a score counts of clear sessions alone, and of what can be reached at all."""

GOALS_FOLLOWED: Mapping[str, Goal] = {
    "told_apart": Goal("told apart with one trial more", 0.90, 1.0),
    "lost": Goal("no longer named", 0.0, 0.05),
}
"""Of effects that were one of several, with the trial that was recommended."""

GOALS_WITHOUT: Mapping[str, Goal] = {
    "unexplained": Goal("unexplained, d ≥ 5", 0.80, 1.0),
    "stage_right": Goal("most of the gap on its stage, d ≥ 5", 0.80, 1.0),
    "confident_wrong": Goal("another name above 90 %", 0.0, 0.05),
}
"""By a catalogue that lacks the effect that is there: as of what is in no catalogue."""
