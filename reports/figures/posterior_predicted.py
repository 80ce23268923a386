"""What the posterior predicts: speed over frequency, and how far each marker swings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from reports.colours import INK, MUTED, TWIN
from reports.numbers import MM, shortened
from reports.style import (
    HALF_WIDTH_IN,
    Grid,
    Margins,
    add_panel,
    legend_on_top,
    name_panels,
    panel,
    panels,
    role_handles,
    role_marker,
    small_multiples,
    styled,
)

if TYPE_CHECKING:
    from fitting import Calibration
    from fitting.posterior.prediction import PredictedSweep, PredictedTrial
    from fitting.posterior.summary import PosteriorSummary

_HEIGHT_IN, _BELOW_IN = 4.4, 1.17  # of the sweep, and of its lower panel


@styled
def posterior_sweep_figure(found: PosteriorSummary, calibration: Calibration) -> Figure:
    """Bands that hold 50 and 90 % of what the twin may do, and trials; below, the same minus its median."""
    figure, axes = panel(HALF_WIDTH_IN, _HEIGHT_IN, Margins(top=0.72, bottom=0.55 + _BELOW_IN))
    difference = add_panel(figure, (0.6, 0.42), (HALF_WIDTH_IN - 0.7, _BELOW_IN))
    sweep = found.sweep
    middle = sweep.inner[2]
    _draw_speeds(axes, sweep, np.zeros_like(middle))
    _draw_speeds(difference, sweep, middle)
    for trial in calibration.trials:
        hz, speed = trial.measured.frequency.hz, trial.measured.speed
        mark = role_marker(INK, trial.measured.role)
        axes.plot(hz, speed * MM, **mark)
        difference.plot(hz, (speed - np.interp(hz, sweep.frequency_hz, middle)) * MM, **mark)
    for part in (axes, difference):
        for limit in calibration.sweep.fitted_hz:
            part.axvline(limit, color=MUTED, linewidth=0.7, linestyle=(0, (2, 2)))
        part.set_xlim(sweep.frequency_hz[0], sweep.frequency_hz[-1])
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.tick_params(labelbottom=False)
    axes.set_ylabel("forward speed (mm/s)")
    difference.set(ylabel="minus median", xlabel="swim frequency (Hz)")
    above: dict[str, Any] = {"loc": "lower left", "columnspacing": 0.9, "handletextpad": 0.5, "borderpad": 0.0}
    bands = [
        Patch(facecolor=TWIN, alpha=0.7, label="coefficients, 90 %"),
        Patch(facecolor=TWIN, alpha=0.38, label="all, 50 %"),
        Patch(facecolor=TWIN, alpha=0.16, label="90 %"),
    ]
    axes.add_artist(axes.legend(handles=bands, bbox_to_anchor=(-0.12, 1.16), ncols=3, **above))
    axes.legend(handles=role_handles(INK), bbox_to_anchor=(-0.12, 1.04), ncols=2, **above)
    return figure


def _draw_speeds(axes: Axes, sweep: PredictedSweep, middle: np.ndarray) -> None:
    """The quantiles (5, f) less a speed (f,)."""
    hz, outer, inner = sweep.frequency_hz, (sweep.outer - middle) * MM, (sweep.inner - middle) * MM
    for low, high, alpha in ((outer[0], outer[-1], 0.16), (outer[1], outer[-2], 0.22), (inner[0], inner[-1], 0.5)):
        axes.fill_between(hz, low, high, color=TWIN, alpha=alpha, linewidth=0)
    axes.plot(hz, inner[2], color=TWIN, linewidth=1.2)


@styled
def posterior_trials_figure(found: PosteriorSummary) -> Figure:
    """A panel a trial, all to one scale: lateral amplitude along the body with its bands."""
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
