"""What other pairs of fit trials give: speed errors and coefficients."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting.pairs import PairFit
from reports.colours import INK, MUTED, SURFACE, TWIN
from reports.figures.coefficients import bounded_panel
from reports.models import model_colour, model_label
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, Look, Margins, legend_above, panel, styled
from swimmer import FluidCoefficients

_SPREAD = 0.42  # of a row that its dots are spread over


@styled
def pair_errors_figure(pairs: Sequence[PairFit], own: frozenset[str]) -> Figure:
    """A row for each model, a dot for each pair; `own` are the session's own fit trials, drawn open."""
    names = list(pairs[0].speed_mae)
    figure, axes = panel(HALF_WIDTH_IN, 1.0 + 0.44 * len(names), Margins(left=1.4))
    for row, name in enumerate(reversed(names)):
        error, colour = np.array([pair.speed_mae[name] for pair in pairs]) * MM, model_colour(name)
        for pair, value, above in zip(pairs, error, _spread(len(pairs), -_SPREAD), strict=True):
            face = SURFACE if frozenset(pair.fitted) == own else colour
            axes.plot(value, row + above, "o", color=colour, markerfacecolor=face, markersize=4.5, zorder=3)
        if np.isfinite(error).any():
            axes.plot([np.nanmean(error)] * 2, [row - 0.34, row + 0.34], color=INK, linewidth=1.6)
    axes.set_yticks(range(len(names)), [model_label(name).replace(" (", "\n(") for name in reversed(names)])
    axes.set(ylim=(-0.6, len(names) - 0.4), xlabel="mean absolute speed error over the others (mm/s)")
    axes.set_xlim(left=0.0)
    dot: Look = {"color": MUTED, "marker": "o", "markersize": 4.5, "linestyle": "none"}
    handles = [Line2D([], [], label="a pair", **dot), Line2D([], [], color=INK, linewidth=1.6, label="mean")]
    if any(frozenset(pair.fitted) == own for pair in pairs):
        handles.append(Line2D([], [], label="this session’s", markerfacecolor=SURFACE, **dot))
    legend_above(axes, 3, handles=handles)
    return figure


@styled
def pair_coefficients_figure(pairs: Sequence[PairFit], best: FluidCoefficients) -> Figure:
    """Dots are pairs, the diamond is the session's own fit; crosses swim backward from rest."""
    figure, axes, rows = bounded_panel(2.76)
    axes.plot(np.sqrt(best), rows, "D", color=TWIN, markersize=6, label="this session’s fit", zorder=3)
    for pair, below in zip(pairs, _spread(len(pairs), 0.4), strict=True):
        mark, label = ("o", "a pair") if pair.swims_forward else ("x", "backward")
        axes.plot(np.sqrt(pair.coefficients), rows + below, mark, color=MUTED, markersize=3.5, label=label)
    legend_above(axes, 3)
    return figure


def _spread(count: int, width: float) -> np.ndarray:
    """(count,) places of dots in a row, evenly over a part of its height."""
    return np.linspace(-width / 2, width / 2, count) if count > 1 else np.zeros(1)
