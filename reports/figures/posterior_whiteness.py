"""Is the noise of the tracks what the posterior takes it for?"""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from reports.figures.small_multiples import small_multiples
from reports.numbers import shortened
from reports.style import FAINT, MUTED, TWIN, Grid, Margins, legend_on_top, panels, styled

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings


@styled
def posterior_whiteness_figure(found: Findings) -> Figure:
    """A panel a fit trial: autocorrelation of the tracks' residuals, of the model, and of what it leaves."""
    layout = small_multiples(len(found.whiteness))
    grid = Grid(min(layout.columns, 2) if not layout.wide else layout.columns, 1.3, gap_in=(0.16, 0.36))
    figure, drawn = panels(
        len(found.whiteness), grid, layout.width_in, Margins(left=0.5, top=0.5 if layout.wide else 0.62)
    )
    for i, (axes, white) in enumerate(zip(drawn, found.whiteness, strict=True)):
        axes.axhspan(-white.limit, white.limit, facecolor=FAINT, linewidth=0)
        axes.plot(white.lag_s, white.modelled, color=MUTED, linewidth=1.0)
        axes.plot(white.lag_s, white.raw, "o", color=MUTED, markersize=2.8)
        axes.plot(white.lag_s, white.left, "o", color=TWIN, markersize=3.2)
        axes.set_ylim(-0.35, 1.0)
        axes.set_xlim(left=0)
        axes.locator_params(axis="x", nbins=4)
        axes.tick_params(labelleft=i % grid.columns == 0)
        axes.set_title(shortened(white.trial), loc="left", pad=2)
    drawn[0].set_ylabel("autocorrelation")
    drawn[-1].set_xlabel("lag (s)")
    handles = [
        Line2D([], [], color=MUTED, marker="o", markersize=2.8, linestyle="none", label="tracks beside a smooth swim"),
        Line2D([], [], color=MUTED, linewidth=1.0, label="noise model"),
        Line2D([], [], color=TWIN, marker="o", markersize=3.2, linestyle="none", label="left after it"),
        Patch(facecolor=FAINT, label="white, 95 %"),
    ]
    legend_on_top(figure, handles, 2 if not layout.wide else 4)
    return figure
