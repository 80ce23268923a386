"""What becomes of a command: measured over commanded speed of the crank."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reports.logged_trial import LoggedTrial
from reports.numbers import shortened
from reports.style import FULL_WIDTH_IN, HALF_WIDTH_IN, INK, MUTED, SURFACE, legend_above, panel, styled

LEAST_REACH = 0.3  # per cent above and below the command
MOST_IN_HALF = 4  # dots, with names beside them


@styled
def motor_command_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """A dot a trial whose command is known; its bar is how far the speed swings within a turn."""
    figure, axes = panel(FULL_WIDTH_IN if len(trials) > MOST_IN_HALF else HALF_WIDTH_IN, 3.1)
    axes.axhline(0.0, color=MUTED, linewidth=0.8)
    reach = LEAST_REACH
    commanded = [trial for trial in trials if trial.motor.commanded_hz > 0]
    middle = np.median([trial.motor.commanded_hz for trial in commanded]) if commanded else 0.0
    for trial in commanded:
        hz, off = trial.motor.commanded_hz, 100 * trial.off_command
        low, high = off + (100 + off) * _swing(trial)
        axes.plot([hz, hz], [low, high], color=MUTED, linewidth=3.0, alpha=0.5)
        face = INK if trial.kind == "swim" else SURFACE
        axes.plot(hz, off, "o", color=INK, markerfacecolor=face, markersize=5.0)
        _name(axes, trial.name, (hz, off), -1 if hz > middle else 1)
        reach = max(reach, -low, high)
    axes.set_ylim(-1.15 * reach, 1.15 * reach)
    axes.margins(x=0.18)
    axes.set_xlabel("commanded (turns/s)")
    axes.set_ylabel("measured, off the command (%)")
    legend_above(axes, 3, handles=_handles())
    return figure


def _name(axes: Axes, name: str, at: tuple[float, float], side: int) -> None:
    """The name on one side of its dot, towards the middle of the figure."""
    ha = "left" if side > 0 else "right"
    axes.annotate(shortened(name), at, (5 * side, 3), textcoords="offset points", ha=ha, fontsize=7.0)


def _swing(trial: LoggedTrial) -> np.ndarray:
    """(2,) how far the speed falls and rises within the mean turn, of its mean."""
    if not len(trial.turns):
        return np.zeros(2)
    mean = trial.turns.mean(axis=0) - 1
    return np.array([mean.min(), mean.max()])


def _handles() -> list[Line2D]:
    dot = {"marker": "o", "color": INK, "markersize": 5.0, "linestyle": "none"}
    return [
        Line2D([], [], label="swim", **dot),  # type: ignore[arg-type]
        Line2D([], [], label="dry run", markerfacecolor=SURFACE, **dot),  # type: ignore[arg-type]
        Line2D([], [], color=MUTED, linewidth=3.0, alpha=0.5, label="within a turn"),
    ]
