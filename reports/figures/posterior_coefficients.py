"""The posterior of the coefficients: intervals, pairs, and what one more swim would make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import gaussian_filter

from fitting.objective import COEFFICIENT_BOUNDS
from reports.colours import EBT, EBT_LARGE, INK, MUTED, SHADE, TWIN, WARN
from reports.figures.coefficients import NAMES
from reports.numbers import significant
from reports.style import (
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    Grid,
    Look,
    Margins,
    add_panel,
    legend_above,
    panel,
    panels,
    styled,
)

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings
    from swimmer import FluidCoefficients

WAYS = ("posterior", "Laplace", "white noise")
COLOURS = dict(zip(WAYS, (TWIN, MUTED, WARN), strict=True))
_LEFT_IN, _PRIOR_IN, _GAP_IN, _ROW_IN, _BETWEEN_IN, _TOP_IN, _BOTTOM_IN = 0.92, 0.95, 0.2, 0.34, 0.3, 0.4, 0.5
_ZOOM_IN = _LEFT_IN + _PRIOR_IN + _GAP_IN  # from the left
_BINS, _SMOOTH = 36, 1.3  # of the densities
_HELD = (0.9, 0.5)  # shares of the draws within the contours
_COLOURS = (TWIN, EBT, EBT_LARGE, INK, WARN)


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
    for i, name in enumerate(NAMES):
        bottom = height - _TOP_IN - _ROW_IN - i * (_ROW_IN + _BETWEEN_IN)
        prior = add_panel(figure, (_LEFT_IN, bottom), (_PRIOR_IN, _ROW_IN))
        zoom = add_panel(figure, (_ZOOM_IN, bottom), (HALF_WIDTH_IN - _ZOOM_IN - 0.12, _ROW_IN))
        _within_prior(prior, intervals["posterior"][:, i], last=i == rows - 1)
        prior.set_yticks([0], [name], fontsize=8)
        _zoomed(zoom, {way: ends[:, i] for way, ends in intervals.items()})
    for left, text in ((_LEFT_IN, "within the prior"), (_ZOOM_IN, "90 % intervals, each on its own scale")):
        figure.text(left / HALF_WIDTH_IN, 0.06 / height, text, fontsize=7.5, color=MUTED)
    handles = [Line2D([], [], color=COLOURS[way], marker="o", markersize=4, label=way) for way in WAYS]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(_LEFT_IN / HALF_WIDTH_IN, 1.0), ncols=3)
    return figure


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


@styled
def posterior_corner_figure(found: Findings, fit: FluidCoefficients) -> Figure:
    """Densities on the diagonal, contours that hold 50 and 90 % of the draws below it, correlations above it.

    Args:
        found: with its draws.
        fit: the coefficients of the fit, marked.
    """
    draws, count = found.chains[..., :5].reshape(-1, 5), len(NAMES)
    margins = Margins(left=0.72, right=0.1, bottom=0.55, top=0.25)
    figure, drawn = panels(count**2, Grid(count, 1.02, gap_in=(0.1, 0.1)), FULL_WIDTH_IN, margins)
    limits = [_limits(draws[:, i]) for i in range(count)]
    for place, axes in enumerate(drawn):
        row, column = divmod(place, count)
        if row < column:
            value = float(found.identifiability.correlation[row, column])
            look: Look = {"ha": "center", "va": "center", "fontsize": 7.5 + 6 * abs(value), "color": MUTED}
            axes.text(0.5, 0.5, f"{value:+.2f}".replace("-", "−"), **look)
            axes.set_axis_off()
            continue
        if row == column:
            _density(axes, draws[:, row], limits[row], fit[row])
            marginal = list(found.marginals.values())[row]
            ends = f"{significant(marginal.q05)} to {significant(marginal.q95)}"
            axes.set_title(ends, loc="left", pad=3, fontsize=7.5)
        else:
            _contours(axes, draws[:, [column, row]], (limits[column], limits[row]))
            axes.plot(fit[column], fit[row], "D", color=EBT, markersize=4)
        _dress(axes, row, column, (limits[column], limits[row]))
    handles = [
        Line2D([], [], color=EBT, marker="D", markersize=4, linestyle="none", label="fit"),
        Patch(facecolor=TWIN, alpha=0.45, label="50 % of the draws"),
        Patch(facecolor=TWIN, alpha=0.18, label="90 %"),
        Line2D([], [], color=MUTED, linestyle="none", label="+0.00  correlation"),
    ]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=7.5)
    return figure


def _limits(values: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(values, [0.001, 0.999])
    margin = 0.06 * (high - low)
    return max(float(low - margin), COEFFICIENT_BOUNDS[0]), min(float(high + margin), COEFFICIENT_BOUNDS[1])


def _density(axes: Axes, values: np.ndarray, limits: tuple[float, float], best: float) -> None:
    heights, edges = np.histogram(values, _BINS, limits, density=True)
    smooth = gaussian_filter(heights, _SMOOTH, mode="nearest")
    middles = (edges[1:] + edges[:-1]) / 2
    low, high = np.quantile(values, [0.05, 0.95])
    axes.fill_between(middles, smooth, color=TWIN, alpha=0.15, linewidth=0)
    axes.fill_between(middles, smooth, where=(middles >= low) & (middles <= high), color=TWIN, alpha=0.35, linewidth=0)
    axes.plot(middles, smooth, color=TWIN)
    axes.axvline(best, color=EBT, linewidth=1.0)
    axes.set_ylim(bottom=0)


def _contours(axes: Axes, pair: np.ndarray, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    counts, x, y = np.histogram2d(pair[:, 0], pair[:, 1], _BINS, limits)
    smooth = gaussian_filter(counts, _SMOOTH, mode="nearest").T
    ordered = np.sort(smooth, axis=None)[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    levels = sorted({float(ordered[np.searchsorted(held, share)]) for share in _HELD})
    middles = ((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2)
    axes.contourf(*middles, smooth, [*levels, smooth.max() * 1.01], colors=[TWIN, TWIN], alpha=0.18)
    if len(levels) > 1:
        axes.contourf(*middles, smooth, [levels[-1], smooth.max() * 1.01], colors=[TWIN], alpha=0.3)
    axes.contour(*middles, smooth, levels, colors=[TWIN], linewidths=0.9)


def _dress(axes: Axes, row: int, column: int, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    axes.set_xlim(*limits[0])
    axes.grid(visible=False)
    axes.locator_params(nbins=4)
    axes.tick_params(labelbottom=row == len(NAMES) - 1, labelleft=row != column and column == 0, labelsize=7, length=2)
    if row == column:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
    else:
        axes.set_ylim(*limits[1])
    if row == len(NAMES) - 1:
        axes.set_xlabel(NAMES[column])
    if column == 0:
        axes.set_ylabel(NAMES[row])


@styled
def posterior_further_figure(found: Findings) -> Figure:
    """The standard deviation of each coefficient with one more swim over that without, by the swim's frequency."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    further = found.further
    order = np.argsort(further.frequency_hz)
    ratio = 100 * further.sd[order] / further.sd_now
    wanted, loose = {"linewidth": 1.6, "markersize": 3}, {"linewidth": 0.8, "linestyle": (0, (2, 2)), "markersize": 1.8}
    for i, name in enumerate(NAMES):
        style = wanted if further.wanted[i] else loose
        axes.plot(further.frequency_hz[order], ratio[:, i], marker="o", color=_COLOURS[i], label=name, **style)
    axes.axvline(further.frequency_hz[0], color=MUTED, linewidth=0.7, linestyle=(0, (2, 2)))
    axes.set_ylim(0, 104)
    axes.set_xlabel("frequency of one more swim (Hz)")
    axes.set_ylabel("standard deviation left (%)")
    legend_above(axes, 3, columnspacing=1.0)
    return figure
