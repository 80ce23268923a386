"""The figure of speed over frequency: trials, the twin with its band, elongated body theory and simple rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting import Calibration
from fitting.model.session_forecast import BASELINES
from reports.colours import EBT, INK, MUTED, SHADE, TWIN
from reports.forecast_words import MODELS
from reports.numbers import MM
from reports.style import Look, Margins, add_panel, legend_above, panel, role_marker, styled

if TYPE_CHECKING:
    from fitting.posterior.prediction import PredictedSweep

WIDTH_IN = 6.3
_HEIGHT_IN = 3.6
_BELOW_IN = 0.9  # height of the lower panel
_BOTTOM_IN = 0.42
_LEFT_IN = 0.66
_RULES: dict[str, Look] = {
    "line": {"linestyle": (0, (1, 1.6))},
    "constant_stride": {"linestyle": (0, (6, 2, 1, 2))},
}


@styled
def speed_sweep_figure(calibration: Calibration, predicted: PredictedSweep | None = None) -> Figure:
    """Draw the speeds above, and below the same minus the twin's.

    Frequencies on grey ground were not fitted; the band is the posterior's.
    """
    bottom = _BOTTOM_IN + _BELOW_IN + 0.14
    figure, axes = panel(WIDTH_IN, _HEIGHT_IN, Margins(left=_LEFT_IN, right=0.06, top=0.44, bottom=bottom))
    below = add_panel(figure, (_LEFT_IN, _BOTTOM_IN), (WIDTH_IN - _LEFT_IN - 0.06, _BELOW_IN))
    sweep = calibration.sweep
    hz, twin = sweep.frequency_hz, sweep.speed_twin
    for part, minus in ((axes, np.zeros_like(twin)), (below, twin)):
        _shade_extrapolated(part, calibration)
        _draw(part, calibration, minus, predicted)
        for trial in calibration.trials:
            at, speed = trial.measured.frequency.hz, trial.measured.speed
            less = float(np.interp(at, hz, minus, left=np.nan, right=np.nan))
            role = trial.measured.role
            label = "filmed, fitted" if role == "fit" else "filmed, held out"
            part.plot(at, (speed - less) * MM, **role_marker(INK, role), label=label)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.tick_params(labelbottom=False)
    axes.set_ylabel("speed (mm/s)")
    below.set(ylabel="minus twin\n(mm/s)", xlabel="tail beat frequency (Hz)")
    legend_above(axes, 4)
    return figure


def _draw(axes: Axes, calibration: Calibration, minus: np.ndarray, predicted: PredictedSweep | None) -> None:
    sweep, trials = calibration.sweep, [t.measured for t in calibration.trials if t.measured.role == "fit"]
    hz = sweep.frequency_hz
    if predicted is not None:
        less = np.interp(predicted.frequency_hz, hz, minus)
        ends = [(predicted.outer[i] - less) * MM for i in (0, -1)]
        axes.fill_between(predicted.frequency_hz, *ends, color=TWIN, alpha=0.16, linewidth=0, label="90 % band")
    known = [trial.frequency.hz for trial in trials], [trial.speed for trial in trials]
    for name, look in _RULES.items():
        rule = np.array(BASELINES[name](*known, list(hz)), float)
        axes.plot(hz, (rule - minus) * MM, color=MUTED, linewidth=1.1, label=MODELS[name], **look)
    theory: Look = {"color": EBT, "linewidth": 1.3, "linestyle": (0, (5, 2)), "label": MODELS["ebt_published"]}
    axes.plot(hz, (sweep.speed_ebt - minus) * MM, **theory)
    axes.plot(hz, (sweep.speed_twin - minus) * MM, color=TWIN, linewidth=1.8, label=MODELS["twin"])


def _shade_extrapolated(axes: Axes, calibration: Calibration) -> None:
    sweep = calibration.sweep
    low, high = sweep.fitted_hz
    first, last = float(np.min(sweep.frequency_hz)), float(np.max(sweep.frequency_hz))
    axes.set_xlim(min(first, low), max(last, high))
    for start, end in ((first, low), (high, last)):
        if start < end:
            axes.axvspan(start, end, facecolor=SHADE, linewidth=0)
