"""How far each marker swings in each trial, beside what the posterior predicts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from reports.figures.role_marker import role_marker
from reports.figures.small_multiples import small_multiples
from reports.numbers import MM, shortened
from reports.style import INK, TWIN, Grid, Margins, legend_on_top, panels, styled

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings
    from fitting.posterior.predictive import PredictedTrial


@styled
def posterior_trials_figure(found: Findings) -> Figure:
    """A panel a trial, all to one scale: lateral amplitude along the body with its bands."""
    layout = small_multiples(len(found.trials))
    grid = Grid(layout.columns, 1.15, gap_in=(0.14, 0.34))
    figure, drawn = panels(
        len(found.trials), grid, layout.width_in, Margins(left=0.5, top=0.5 if layout.wide else 0.62)
    )
    highest = max(float(max(trial.swing_m.max(), trial.swing_outer.max())) for trial in found.trials) * MM
    for i, (axes, trial) in enumerate(zip(drawn, found.trials, strict=True)):
        _bands(axes, trial)
        axes.set_ylim(0.0, 1.05 * highest)
        axes.tick_params(labelleft=i % layout.columns == 0, labelbottom=i + layout.columns >= len(drawn))
        axes.set_title(shortened(trial.name), loc="left", pad=2)
    drawn[0].set_ylabel("lateral amplitude (mm)")
    drawn[-1].set_xlabel("along the body (mm)")
    handles = [
        Line2D([], [], label="measured, fit", **role_marker(INK, "fit")),
        Line2D([], [], label="held out", **role_marker(INK, "holdout")),
        Patch(facecolor=TWIN, alpha=0.65, label="coefficients, 90 %"),
        Patch(facecolor=TWIN, alpha=0.2, label="all, 90 %"),
    ]
    legend_on_top(figure, handles, 2 if layout.columns < 4 else 4)
    return figure


def _bands(axes: Axes, trial: PredictedTrial) -> None:
    order = trial.place_m.argsort()
    place = trial.place_m[order] * MM
    for band, alpha in ((trial.swing_outer, 0.2), (trial.swing_inner, 0.55)):
        axes.fill_between(place, band[0, order] * MM, band[-1, order] * MM, color=TWIN, alpha=alpha, linewidth=0)
    mark = role_marker(INK, trial.role) | {"markersize": 3.2, "markeredgewidth": 0.9}
    axes.plot(place, trial.swing_m[order] * MM, **mark)
    axes.locator_params(axis="x", nbins=4)
