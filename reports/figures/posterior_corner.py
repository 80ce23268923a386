"""The posterior of every coefficient and of every pair."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import gaussian_filter

from fitting.objective import COEFFICIENT_BOUNDS
from reports.figures.coefficient_scale import NAMES
from reports.numbers import significant
from reports.style import EBT, FULL_WIDTH_IN, MUTED, TWIN, styled

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings
    from swimmer import FluidCoefficients

_LEFT_IN, _BOTTOM_IN, _TOP_IN, _RIGHT_IN, _GAP_IN, _HEIGHT_IN = 0.72, 0.55, 0.25, 0.1, 0.1, 1.02
_BINS, _SMOOTH = 36, 1.3
_HELD = (0.9, 0.5)  # shares of the draws within the contours


@styled
def posterior_corner_figure(found: Findings, fit: FluidCoefficients) -> Figure:
    """Densities on the diagonal, contours that hold 50 and 90 % of the draws below it, correlations above it.

    Args:
        found: with its draws.
        fit: the coefficients of the fit, marked.
    """
    draws, count = found.chains[..., :5].reshape(-1, 5), len(NAMES)
    width = (FULL_WIDTH_IN - _LEFT_IN - _RIGHT_IN - (count - 1) * _GAP_IN) / count
    height = _BOTTOM_IN + _TOP_IN + count * _HEIGHT_IN + (count - 1) * _GAP_IN
    figure = Figure(figsize=(FULL_WIDTH_IN, height))
    limits = [_limits(draws[:, i]) for i in range(count)]
    for row in range(count):
        for column in range(count):
            left = _LEFT_IN + column * (width + _GAP_IN)
            bottom = height - _TOP_IN - (row + 1) * _HEIGHT_IN - row * _GAP_IN
            axes = figure.add_axes((left / FULL_WIDTH_IN, bottom / height, width / FULL_WIDTH_IN, _HEIGHT_IN / height))
            if row < column:
                _correlation(axes, float(found.identifiability.correlation[row, column]))
                continue
            if row == column:
                _density(axes, draws[:, row], limits[row], fit[row])
                axes.set_title(_told(found, row), loc="left", pad=3, fontsize=7.5)
            else:
                _contours(axes, draws[:, [column, row]], (limits[column], limits[row]))
                axes.plot(fit[column], fit[row], "D", color=EBT, markersize=4)
            _dress(axes, row, column, (limits[column], limits[row]))
    _legend(figure)
    return figure


def _limits(values: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(values, [0.001, 0.999])
    margin = 0.06 * (high - low)
    return max(float(low - margin), COEFFICIENT_BOUNDS[0]), min(float(high + margin), COEFFICIENT_BOUNDS[1])


def _told(found: Findings, i: int) -> str:
    marginal = list(found.marginals.values())[i]
    return f"{significant(marginal.q05)} to {significant(marginal.q95)}"


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


def _correlation(axes: Axes, value: float) -> None:
    axes.set_axis_off()
    size = 7.5 + 6 * abs(value)
    axes.text(0.5, 0.5, f"{value:+.2f}".replace("-", "−"), ha="center", va="center", fontsize=size, color=MUTED)


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


def _legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], color=EBT, marker="D", markersize=4, linestyle="none", label="fit"),
        Patch(facecolor=TWIN, alpha=0.45, label="50 % of the draws"),
        Patch(facecolor=TWIN, alpha=0.18, label="90 %"),
        Line2D([], [], color=MUTED, linestyle="none", label="+0.00  correlation"),
    ]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=7.5)
