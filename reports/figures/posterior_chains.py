"""Did the sampler mix? Traces of the walkers, and their ranks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.stats import rankdata

from reports.figures.coefficient_scale import NAMES
from reports.style import (
    EBT,
    EBT_LARGE,
    HALF_WIDTH_IN,
    INK,
    MUTED,
    SHADE,
    TWIN,
    Grid,
    Margins,
    legend_on_top,
    panels,
    styled,
)

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings

_POINTS = 120  # drawn of a trace
_GROUPS, _BINS = 4, 10
_COLOURS = (TWIN, EBT, EBT_LARGE, INK)


@styled
def posterior_trace_figure(found: Findings) -> Figure:
    """A panel a coefficient: where the middle half and 90 % of the walkers are, and two walkers, draw after draw."""
    figure, drawn = panels(len(NAMES), Grid(1, 0.52, gap_in=(0.0, 0.22)), HALF_WIDTH_IN, Margins(left=0.6, top=0.5))
    chains = found.chains[:, :: max(found.chains.shape[1] // _POINTS, 1)]
    draws = np.linspace(0, found.chains.shape[1], chains.shape[1])
    for i, (axes, name) in enumerate(zip(drawn, NAMES, strict=True)):
        low, lower, upper, high = np.quantile(chains[..., i], [0.05, 0.25, 0.75, 0.95], axis=0)
        axes.fill_between(draws, low, high, color=TWIN, alpha=0.18, linewidth=0)
        axes.fill_between(draws, lower, upper, color=TWIN, alpha=0.3, linewidth=0)
        for chain, colour in zip(chains[[0, len(chains) // 2], :, i], (INK, EBT), strict=True):
            axes.plot(draws, chain, color=colour, linewidth=0.6)
        axes.set_xlim(draws[0], draws[-1])
        axes.locator_params(axis="y", nbins=3)
        axes.tick_params(labelbottom=i == len(NAMES) - 1)
        axes.set_title(name, loc="left", pad=2)
    drawn[-1].set_xlabel("draw of each walker, after the burn-in, thinned")
    handles = [
        Patch(facecolor=TWIN, alpha=0.5, label="half of the walkers"),
        Patch(facecolor=TWIN, alpha=0.18, label="90 %"),
        Line2D([], [], color=INK, linewidth=0.8, label="two of them"),
    ]
    legend_on_top(figure, handles, 3)
    return figure


@styled
def posterior_ranks_figure(found: Findings) -> Figure:
    """A panel a coefficient: how the ranks of four groups of walkers spread; flat within the band means well mixed."""
    figure, drawn = panels(len(NAMES), Grid(1, 0.52, gap_in=(0.0, 0.22)), HALF_WIDTH_IN, Margins(left=0.6, top=0.5))
    edges = np.linspace(0.0, 1.0, _BINS + 1)
    for i, (axes, name) in enumerate(zip(drawn, NAMES, strict=True)):
        ranks = rankdata(found.chains[..., i]).reshape(found.chains.shape[:2]) / found.chains[..., i].size
        each = found.ess_bulk[i] / _GROUPS
        spread = 1.96 * np.sqrt((1 - 1 / _BINS) * _BINS / each)  # of a bin's share over 1 / bins
        axes.axhspan(1 - spread, 1 + spread, facecolor=SHADE, linewidth=0)
        for group, colour in zip(np.array_split(ranks, _GROUPS), _COLOURS, strict=True):
            share = np.histogram(group, edges)[0] * _BINS / group.size
            axes.stairs(share, edges, color=colour, linewidth=0.9, baseline=None)
        axes.axhline(1.0, color=MUTED, linewidth=0.6)
        reach = max(0.3, 1.6 * spread)
        axes.set_ylim(1 - reach, 1 + reach)
        axes.set_xlim(0, 1)
        axes.locator_params(axis="y", nbins=3)
        axes.tick_params(labelbottom=i == len(NAMES) - 1)
        axes.set_title(name, loc="left", pad=2)
    drawn[2].set_ylabel("density of the ranks")
    drawn[-1].set_xlabel("rank among all draws")
    handles = [Line2D([], [], color=colour, label=f"quarter {k + 1}") for k, colour in enumerate(_COLOURS)]
    legend_on_top(figure, handles, 4)
    return figure
