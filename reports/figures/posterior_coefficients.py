"""The figures of the posterior of the coefficients: intervals, pairs, and the value of one more swim."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import gaussian_filter

from reports.colours import EBT, EBT_LARGE, INK, MUTED, SHADE, TWIN, WARN
from reports.figures.coefficients import NAMES
from reports.numbers import significant
from reports.style import (
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    Grid,
    Look,
    Margins,
    legend_above,
    panel,
    panels,
    styled,
)
from swimmer.fluid import COEFFICIENT_BOUNDS

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary
    from swimmer import FluidCoefficients

_BINS = 36  # bins of the densities
_SMOOTH = 1.3  # standard deviation of the filter that smooths them, bins
_HELD = (0.9, 0.5)  # shares of the draws within the contours
_COLOURS = (TWIN, EBT, EBT_LARGE, INK, WARN)


@styled
def posterior_intervals_figure(found: PosteriorSummary, fit: FluidCoefficients) -> Figure:
    """Draw interval and mean of each coefficient within the prior, and the fit."""
    figure, axes = panel(HALF_WIDTH_IN, 2.4, Margins(left=0.92, top=0.35))
    low, high = COEFFICIENT_BOUNDS
    rows = -np.arange(len(NAMES))
    axes.barh(rows, high - low, left=low, height=0.5, color=SHADE)
    for row, marginal in zip(rows, found.marginals.values(), strict=True):
        axes.plot([marginal.q05, marginal.q95], [row, row], color=TWIN, linewidth=7, solid_capstyle="butt")
    means = [marginal.mean for marginal in found.marginals.values()]
    axes.plot(means, rows, "|", color=INK, markersize=11, markeredgewidth=1.2, label="mean")
    axes.plot(fit, rows, "D", color=EBT, markersize=4, label="fit")
    axes.set_yticks(rows, NAMES, fontsize=8)
    axes.set_xlim(low - 0.3, high + 0.3)
    axes.grid(visible=False)
    legend_above(axes, 2)
    return figure


@styled
def posterior_corner_figure(found: PosteriorSummary, fit: FluidCoefficients) -> Figure:
    """Draw densities on the diagonal, contours that hold 50 and 90 % of the draws below it, correlations above it."""
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
def posterior_further_figure(found: PosteriorSummary) -> Figure:
    """Draw the standard deviation of each coefficient with one more swim over that without, by the swim's frequency."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    sweep, chosen = found.sweep, found.wanted
    ratio = 100 * sweep.sd / sweep.sd_now
    wanted, loose = {"linewidth": 1.6, "markersize": 3}, {"linewidth": 0.8, "linestyle": (0, (2, 2)), "markersize": 1.8}
    for i, name in enumerate(NAMES):
        style = wanted if chosen[i] else loose
        axes.plot(sweep.frequency_hz, ratio[:, i], marker="o", color=_COLOURS[i], label=name, **style)
    axes.axvline(
        sweep.frequency_hz[np.argmin(sweep.shrinkage(chosen))], color=MUTED, linewidth=0.7, linestyle=(0, (2, 2))
    )
    axes.set(ylim=(0, 104), xlabel="frequency of one more trial (Hz)", ylabel="standard deviation, % of now")
    legend_above(axes, 3, columnspacing=1.0)
    return figure
