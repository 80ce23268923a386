"""What the trials made of the prior of each coefficient, and what other ways would have said."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting.objective import COEFFICIENT_BOUNDS
from reports.figures.coefficient_scale import NAMES
from reports.style import HALF_WIDTH_IN, INK, MUTED, SHADE, TWIN, WARN, styled

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings

WAYS = ("posterior", "Laplace", "white noise")
COLOURS = dict(zip(WAYS, (TWIN, MUTED, WARN), strict=True))
_LEFT_IN, _PRIOR_IN, _GAP_IN, _ROW_IN, _BETWEEN_IN, _TOP_IN, _BOTTOM_IN = 0.92, 0.95, 0.2, 0.34, 0.3, 0.4, 0.5


def intervals_of(found: Findings) -> dict[str, np.ndarray]:
    """(3, 5) 5 % end, middle and 95 % end of each coefficient, by the way they were found."""
    marginals = list(found.marginals.values())
    own = np.array([[m.q05 for m in marginals], [m.mean for m in marginals], [m.q95 for m in marginals]])
    others = [np.stack([way.q05, way.middle, way.q95]) for way in (found.laplace, found.naive)]
    return dict(zip(WAYS, (own, *others), strict=True))


@styled
def posterior_intervals_figure(found: Findings) -> Figure:
    """A row a coefficient: left the posterior within the prior, right all intervals on a scale of their own."""
    rows, intervals = len(NAMES), intervals_of(found)
    height = _TOP_IN + rows * (_ROW_IN + _BETWEEN_IN) - _BETWEEN_IN + _BOTTOM_IN
    figure = Figure(figsize=(HALF_WIDTH_IN, height))
    wide = HALF_WIDTH_IN - _LEFT_IN - _PRIOR_IN - _GAP_IN - 0.12
    for i, name in enumerate(NAMES):
        bottom = height - _TOP_IN - _ROW_IN - i * (_ROW_IN + _BETWEEN_IN)
        prior = figure.add_axes(_place(_LEFT_IN, bottom, _PRIOR_IN, height))
        zoom = figure.add_axes(_place(_LEFT_IN + _PRIOR_IN + _GAP_IN, bottom, wide, height))
        _within_prior(prior, intervals["posterior"][:, i], last=i == rows - 1)
        prior.set_yticks([0], [name], fontsize=8)
        _zoomed(zoom, {way: ends[:, i] for way, ends in intervals.items()})
    figure.text(_LEFT_IN / HALF_WIDTH_IN, 0.06 / height, "within the prior", fontsize=7.5, color=MUTED)
    figure.text(
        (_LEFT_IN + _PRIOR_IN + _GAP_IN) / HALF_WIDTH_IN,
        0.06 / height,
        "90 % intervals, each on its own scale",
        fontsize=7.5,
        color=MUTED,
    )
    handles = [Line2D([], [], color=COLOURS[way], marker="o", markersize=4, label=way) for way in WAYS]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(_LEFT_IN / HALF_WIDTH_IN, 1.0), ncols=3)
    return figure


def _place(left: float, bottom: float, width: float, height: float) -> tuple[float, float, float, float]:
    return left / HALF_WIDTH_IN, bottom / height, width / HALF_WIDTH_IN, _ROW_IN / height


def _within_prior(axes: Axes, ends: np.ndarray, last: bool) -> None:
    low, high = COEFFICIENT_BOUNDS
    axes.barh(0, high - low, left=low, height=0.5, color=SHADE)
    axes.plot(ends[[0, 2]], [0, 0], color=TWIN, linewidth=7, solid_capstyle="butt")
    axes.plot(ends[1], 0, "|", color=TWIN, markersize=13, markeredgewidth=1.5)
    axes.set_xlim(low - 0.3, high + 0.3)
    axes.set_ylim(-0.5, 0.5)
    axes.set_xticks([low, (low + high) / 2, high])
    axes.tick_params(axis="x", labelbottom=last, length=2)
    axes.tick_params(axis="y", length=0, labelcolor=INK)
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)


def _zoomed(axes: Axes, ways: dict[str, np.ndarray]) -> None:
    known = np.concatenate([ends[np.isfinite(ends)] for ends in ways.values()])
    margin = 0.08 * max(float(np.ptp(known)), 1e-3)
    for row, (way, (low, middle, high)) in enumerate(ways.items()):
        axes.plot([low, high], [-row, -row], color=COLOURS[way], linewidth=1.8 if row == 0 else 1.2)
        axes.plot(middle, -row, "o", color=COLOURS[way], markersize=4 if row == 0 else 3)
    axes.set_xlim(known.min() - margin, known.max() + margin)
    axes.set_ylim(-2.6, 0.6)
    axes.set_yticks([])
    axes.locator_params(axis="x", nbins=4)
    axes.tick_params(axis="x", labelsize=7, length=2, pad=1.5)
    axes.spines["left"].set_visible(False)
