"""What the twin leaves out: which effects these trials would show, and how far each would move a coefficient."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from reports.colours import INK, MUTED, SHADE, TWIN, WARN
from reports.numbers import in_words, shortened
from reports.style import FULL_WIDTH_IN, Margins, legend_above, panel, styled

if TYPE_CHECKING:
    from fitting.left_out import LeftOut
    from fitting.posterior.findings import Findings

_X, _Y = (0.03, 300.0), (0.01, 100.0)
_NAMED, _BETWEEN = 10, 0.095  # names, those that move most; between them, of the height of the panel


@styled
def posterior_left_out_figure(found: Findings) -> Figure:
    """A point a parameter of an effect: right what would be seen, above what would move a coefficient."""
    figure, axes = panel(FULL_WIDTH_IN, 3.3, Margins(right=2.1, top=0.42))
    tried, seen_from = found.left_out.tried, found.left_out.seen_from
    axes.fill_between((_X[0], seen_from), 1.0, _Y[1], color=SHADE, linewidth=0)
    kinds = {
        "asked for by these trials": (WARN, [each for each in tried if each.asked]),
        "may move a coefficient unseen": (INK, [each for each in tried if each.hides and not each.asked]),
        "seen, allowed for, or no matter": (MUTED, [each for each in tried if not each.hides and not each.asked]),
    }
    for label, (colour, own) in kinds.items():
        x, y = (np.clip([_place(each)[i] for each in own], *ends) for i, ends in ((0, _X), (1, _Y)))
        axes.scatter(x, y, s=9 if colour == MUTED else 18, color=colour, label=label, zorder=3, clip_on=False)
    _labels(axes, [(each, colour) for colour, own in kinds.values() if colour != MUTED for each in own])
    axes.axvline(seen_from, color=TWIN, linewidth=0.8, linestyle=(0, (2, 2)))
    axes.set(xscale="log", yscale="log", xlim=_X, ylim=_Y)
    axes.set_xlabel("how clearly these trials would show it (standard deviations)")
    axes.set_ylabel("coefficient that it moves most (its sd)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    legend_above(axes, 3, columnspacing=1.0)
    return figure


def _place(each: LeftOut) -> tuple[float, float]:
    """How clearly it shows, and how far it moves the coefficient that it moves most."""
    return each.shows, float(abs(each.moves[each.most]))


def _labels(axes: Axes, named: list[tuple[LeftOut, str]]) -> None:
    """Names in a column beside the panel, the highest point first, each with a line to its point."""
    order = sorted(named, key=lambda own: -_place(own[0])[1])[:_NAMED]
    middle = (len(order) - 1) / 2
    for row, (each, colour) in enumerate(order):
        x, y = (float(np.clip(value, *ends)) for value, ends in zip(_place(each), (_X, _Y), strict=True))
        axes.annotate(
            shortened(in_words(each.name), 34),
            (x, y),
            xytext=(1.02, 0.5 + _BETWEEN * (middle - row)),
            textcoords="axes fraction",
            va="center",
            fontsize=7.5,
            color=colour,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4, "shrinkB": 2, "relpos": (0, 0.5)},
        )
