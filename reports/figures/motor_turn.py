"""How evenly the crank turns: its speed through a turn."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reports.figures.small_multiples import Layout, small_multiples
from reports.logged_trial import BINS, LoggedTrial
from reports.numbers import shortened
from reports.style import FULL_WIDTH_IN, HALF_WIDTH_IN, INK, MUTED, Grid, Margins, legend_on_top, panels, styled

LEAST_REACH = 1.0  # per cent above and below the mean
MOST_TURNS = 40  # drawn of each trial
TALL_IN, ROW_IN = 2.2, 1.4  # of all panels where there are one or two rows, of each row where there are more


def motor_turn_layout(count: int) -> Layout:
    """As of all small multiples, but one or two fill the width, where nothing stands beside them."""
    if count < 3:
        return Layout(FULL_WIDTH_IN, max(count, 1), wide=True)
    return Layout(HALF_WIDTH_IN, 2, wide=False) if count == 4 else small_multiples(count)


@styled
def motor_turn_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """A panel a trial, to one scale: off its mean speed over the shaft's angle, every turn and their mean."""
    width, columns, _ = motor_turn_layout(len(trials))
    rows, gap = -(-len(trials) // columns), 0.42
    height = ROW_IN if rows > 2 else (TALL_IN - gap * (rows - 1)) / rows
    figure, drawn = panels(len(trials), Grid(columns, height, gap_in=(0.28, gap)), width, Margins(top=0.5, right=0.16))
    turns = [100 * (trial.turns - 1) for trial in trials]
    reach = 1.1 * max([LEAST_REACH, *(float(np.abs(percent).max()) for percent in turns if len(percent))])
    for number, (trial, percent, axes) in enumerate(zip(trials, turns, drawn, strict=True)):
        _draw(axes, percent)
        axes.set_ylim(-reach, reach)
        axes.set_title(shortened(trial.name), loc="left", fontweight="bold", pad=4)
        if number % columns == 0:
            axes.set_ylabel("off its mean (%)")
        else:
            axes.tick_params(axis="y", labelleft=False)
        if number >= len(trials) - columns:
            axes.set_xlabel("angle of the shaft")
    legend_on_top(figure, _handles(), 2)
    return figure


def _draw(axes: Axes, percent: np.ndarray) -> None:
    """Turns (t, BINS) as thin lines, closed to a whole turn, and their mean."""
    angle_deg = 360 * np.arange(BINS + 1) / BINS
    closed = np.concatenate([percent, percent[:, :1]], axis=1)
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    axes.plot(angle_deg, closed[-MOST_TURNS:].T, color=MUTED, linewidth=0.4, alpha=0.35)
    if len(closed):
        axes.plot(angle_deg, closed.mean(axis=0), color=INK, linewidth=1.6)
    axes.set_xlim(0, 360)
    axes.set_xticks([0, 180, 360], ["0°", "180°", "360°"])


def _handles() -> list[Line2D]:
    return [
        Line2D([], [], color=MUTED, linewidth=0.6, label="a turn"),
        Line2D([], [], color=INK, linewidth=1.6, label="mean of the turns"),
    ]
