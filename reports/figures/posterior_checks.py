"""The figures that show whether to believe the posterior: traces and ranks of walkers, and the noise of tracks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import rankdata

from reports.colours import EBT, EBT_LARGE, FAINT, INK, MUTED, SHADE, TWIN
from reports.figures.coefficients import NAMES
from reports.numbers import shortened
from reports.style import (
    HALF_WIDTH_IN,
    Grid,
    Margins,
    legend_on_top,
    name_panels,
    panels,
    small_multiples,
    styled,
)

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary

_POINTS = 120  # number of points drawn of a trace
_GROUPS = 4  # number of groups of walkers
_BINS = 10  # bins of the ranks
_COLOURS = (TWIN, EBT, EBT_LARGE, INK)


@styled
def posterior_trace_figure(found: PosteriorSummary) -> Figure:
    """Draw where the middle half and 90 % of the walkers are, and two of the walkers, draw by draw, a panel a
    coefficient.
    """
    figure, drawn = _panel_each("draw of each walker, after the burn-in, thinned")
    chains = found.chains[:, :: max(found.chains.shape[1] // _POINTS, 1)]
    draws = np.linspace(0, found.chains.shape[1], chains.shape[1])
    for i, axes in enumerate(drawn):
        low, lower, upper, high = np.quantile(chains[..., i], [0.05, 0.25, 0.75, 0.95], axis=0)
        axes.fill_between(draws, lower, upper, color=TWIN, alpha=0.3, linewidth=0, label="half of the walkers")
        axes.fill_between(draws, low, high, color=TWIN, alpha=0.18, linewidth=0, label="90 %")
        for chain, colour in zip(chains[[len(chains) // 2, 0], :, i], (EBT, INK), strict=True):
            axes.plot(draws, chain, color=colour, linewidth=0.6, label="two of them")
        axes.set_xlim(draws[0], draws[-1])
        axes.locator_params(axis="y", nbins=3)
    legend_on_top(figure, 3)
    return figure


@styled
def posterior_ranks_figure(found: PosteriorSummary) -> Figure:
    """Draw how the ranks of four groups of walkers spread, a panel a coefficient.

    Flat within the band means well mixed.
    """
    figure, drawn = _panel_each("rank among all draws")
    edges = np.linspace(0.0, 1.0, _BINS + 1)
    for i, axes in enumerate(drawn):
        ranks = rankdata(found.chains[..., i]).reshape(found.chains.shape[:2]) / found.chains[..., i].size
        each = found.ess_bulk[i] / _GROUPS
        spread = 1.96 * np.sqrt((1 - 1 / _BINS) * _BINS / each)  # half width of the band of a bin's share times bins
        axes.axhspan(1 - spread, 1 + spread, facecolor=SHADE, linewidth=0)
        for quarter, colour in enumerate(_COLOURS):
            group = np.array_split(ranks, _GROUPS)[quarter]
            share = np.histogram(group, edges)[0] * _BINS / group.size
            axes.stairs(share, edges, color=colour, linewidth=0.9, baseline=None, label=f"quarter {quarter + 1}")
        axes.axhline(1.0, color=MUTED, linewidth=0.6)
        reach = max(0.3, 1.6 * spread)
        axes.set(xlim=(0, 1), ylim=(1 - reach, 1 + reach))
        axes.locator_params(axis="y", nbins=3)
    drawn[2].set_ylabel("density of the ranks")
    legend_on_top(figure, 4)
    return figure


def _panel_each(x: str) -> tuple[Figure, list[Axes]]:
    """Make a low panel for each coefficient, one below the other."""
    margins = Margins(left=0.6, top=0.5)
    figure, drawn = panels(len(NAMES), Grid(1, 0.52, gap_in=(0.0, 0.22)), HALF_WIDTH_IN, margins)
    name_panels(drawn, NAMES, 1, x)
    return figure, drawn


@styled
def posterior_whiteness_figure(found: PosteriorSummary) -> Figure:
    """Draw the autocorrelation of the tracks' residuals, and of what the noise model leaves, a panel a fit trial."""
    width, columns = small_multiples(len(found.whiteness))
    wide = width > HALF_WIDTH_IN
    grid = Grid(columns if wide else min(columns, 2), 1.3, gap_in=(0.16, 0.36))
    figure, drawn = panels(len(found.whiteness), grid, width, Margins(left=0.5, top=0.5 if wide else 0.62))
    name_panels(drawn, [shortened(white.trial) for white in found.whiteness], grid.columns)
    for axes, white in zip(drawn, found.whiteness, strict=True):
        axes.plot(white.lag_s, white.raw, "o", color=MUTED, markersize=2.8, label="tracking errors")
        axes.plot(white.lag_s, white.innovations, "o", color=TWIN, markersize=3.2, label="residual of the noise model")
        axes.axhspan(-white.limit, white.limit, facecolor=FAINT, linewidth=0, label="white, 95 %")
        axes.set_ylim(-0.35, 1.0)
        axes.set_xlim(left=0)
        axes.locator_params(axis="x", nbins=4)
        axes.tick_params(labelbottom=True)
    drawn[0].set_ylabel("autocorrelation")
    drawn[-1].set_xlabel("lag (s)")
    legend_on_top(figure, 4 if wide else 2)
    return figure
