"""The figure of what the posterior predicts: how far each marker swings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from reports.colours import INK, TWIN
from reports.numbers import MM, shortened
from reports.style import (
    HALF_WIDTH_IN,
    Grid,
    Margins,
    legend_on_top,
    name_panels,
    panels,
    role_handles,
    role_marker,
    small_multiples,
    styled,
)

if TYPE_CHECKING:
    from fitting.posterior.prediction import PredictedTrial
    from fitting.posterior.summary import PosteriorSummary


@styled
def posterior_trials_figure(found: PosteriorSummary) -> Figure:
    """Draw the lateral amplitude along the body with its bands, a panel a trial, all to one scale."""
    width, columns = small_multiples(len(found.trials))
    top = 0.5 if width > HALF_WIDTH_IN else 0.62
    figure, drawn = panels(len(found.trials), Grid(columns, 1.15, (0.14, 0.34)), width, Margins(left=0.5, top=top))
    highest = max(float(max(trial.swing_m.max(), trial.swing_outer.max())) for trial in found.trials) * MM
    for axes, trial in zip(drawn, found.trials, strict=True):
        _draw_swings(axes, trial)
        axes.set_ylim(0.0, 1.05 * highest)
    name_panels(drawn, [shortened(trial.name) for trial in found.trials], columns)
    drawn[0].set_ylabel("lateral amplitude (mm)")
    drawn[-1].set_xlabel("along the body (mm)")
    bands = [
        Patch(facecolor=TWIN, alpha=0.65, label="coefficients, 90 %"),
        Patch(facecolor=TWIN, alpha=0.2, label="all, 90 %"),
    ]
    legend_on_top(figure, 2 if columns < 4 else 4, [*role_handles(INK), *bands])
    return figure


def _draw_swings(axes: Axes, trial: PredictedTrial) -> None:
    order = trial.place_m.argsort()
    place = trial.place_m[order] * MM
    for band, alpha in ((trial.swing_outer, 0.2), (trial.swing_inner, 0.55)):
        axes.fill_between(place, band[0, order] * MM, band[-1, order] * MM, color=TWIN, alpha=alpha, linewidth=0)
    mark = role_marker(INK, trial.role) | {"markersize": 3.2, "markeredgewidth": 0.9}
    axes.plot(place, trial.swing_m[order] * MM, **mark)
    axes.locator_params(axis="x", nbins=4)
