"""Speed errors over many choices of the two fit trials."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import PairFit
from reports.models import model_colour, model_label
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, INK, MUTED, SURFACE, Margins, legend_above, panel, styled

_SPREAD = 0.42  # of a row that its dots are spread over


@styled
def pair_errors_figure(pairs: Sequence[PairFit], own: frozenset[str] = frozenset()) -> Figure:
    """A row for each model, a dot for each pair; `own` are the session's own fit trials, drawn open."""
    names = list(pairs[0].speed_mae)
    figure, axes = panel(HALF_WIDTH_IN, 1.0 + 0.44 * len(names), Margins(left=1.4))
    shift = np.linspace(_SPREAD / 2, -_SPREAD / 2, len(pairs)) if len(pairs) > 1 else np.zeros(1)
    for row, name in enumerate(reversed(names)):
        error, colour = np.array([pair.speed_mae[name] for pair in pairs]) * MM, model_colour(name)
        for pair, value, above in zip(pairs, error, shift, strict=True):
            face = SURFACE if frozenset(pair.fitted) == own else colour
            axes.plot(value, row + above, "o", color=colour, markerfacecolor=face, markersize=4.5, zorder=3)
        if np.isfinite(error).any():
            axes.plot([np.nanmean(error)] * 2, [row - 0.34, row + 0.34], color=INK, linewidth=1.6)
    axes.set_yticks(range(len(names)), [model_label(name).replace(" (", "\n(") for name in reversed(names)])
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("mean absolute speed error over the others (mm/s)")
    handles = [
        Line2D([], [], color=MUTED, marker="o", markersize=4.5, linestyle="none", label="a pair"),
        Line2D([], [], color=INK, linewidth=1.6, label="mean"),
    ]
    if any(frozenset(pair.fitted) == own for pair in pairs):
        mark = {"marker": "o", "markersize": 4.5, "linestyle": "none", "markerfacecolor": SURFACE}
        handles.insert(1, Line2D([], [], color=MUTED, label="this session’s", **mark))  # type: ignore[arg-type]
    legend_above(axes, 3, handles=handles)
    return figure
