"""What the twin leaves out: which effects these trials would show, and how far each would move a coefficient."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from reports.numbers import in_words, shortened
from reports.style import FULL_WIDTH_IN, INK, MUTED, SHADE, TWIN, WARN, Margins, legend_above, panel, styled

if TYPE_CHECKING:
    from fitting.left_out import LeftOut
    from fitting.posterior.findings import Findings

_X, _Y = (0.03, 300.0), (0.01, 100.0)
_NAMED = 8  # of each kind, the worst first


@styled
def posterior_left_out_figure(found: Findings) -> Figure:
    """A point a parameter of an effect: right what would be seen, above what would move a coefficient."""
    figure, axes = panel(FULL_WIDTH_IN, 3.3, Margins(top=0.42))
    tried, seen_from = found.left_out.tried, found.left_out.seen_from
    axes.fill_between((_X[0], seen_from), 1.0, _Y[1], color=SHADE, linewidth=0)
    kinds = {
        "asked for by these trials": (WARN, [each for each in tried if each.asked]),
        "may move a coefficient unseen": (INK, [each for each in tried if each.hides and not each.asked]),
        "seen, allowed for, or no matter": (MUTED, [each for each in tried if not each.hides and not each.asked]),
    }
    for label, (colour, own) in kinds.items():
        x, y = (np.clip([place(each)[i] for each in own], *ends) for i, ends in ((0, _X), (1, _Y)))
        axes.scatter(x, y, s=9 if colour == MUTED else 18, color=colour, label=label, zorder=3, clip_on=False)
        if colour != MUTED:
            _label(axes, own, colour)
    axes.axvline(seen_from, color=TWIN, linewidth=0.8, linestyle=(0, (2, 2)))
    axes.set(xscale="log", yscale="log", xlim=_X, ylim=_Y)
    axes.set_xlabel("how clearly these trials would show it (standard deviations)")
    axes.set_ylabel("coefficient that it moves most (its sd)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    legend_above(axes, 3, columnspacing=1.0)
    return figure


def place(each: LeftOut) -> tuple[float, float]:
    """How clearly it shows, and how far it moves the coefficient that it moves most."""
    return each.shows, float(np.abs(each.moves).max())


def _label(axes: Axes, own: list[LeftOut], colour: str) -> None:
    for each in sorted(own, key=lambda each: -place(each)[1])[:_NAMED]:
        x, y = (float(np.clip(value, *ends)) for value, ends in zip(place(each), (_X, _Y), strict=True))
        axes.annotate(
            shortened(in_words(each.name), 34),
            (x, y),
            xytext=(-4, 2) if x > 1 else (4, 2),
            textcoords="offset points",
            ha="right" if x > 1 else "left",
            fontsize=7,
            color=colour,
        )
