"""Speeds over frequency, and how far off each model's are."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import Calibration
from fitting.sweep import SpeedSweep
from reports.colours import INK, MUTED, SHADE, TWIN
from reports.models import model_colour, model_label
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, Margins, legend_above, panel, role_handles, role_marker, styled

_THEORY = ("published", "smoothed", "large")
_SHOWN = {"twin": 0.22, "published": 0.0, "large": -0.22}  # models, and how far above their row


@styled
def speed_sweep_figure(calibration: Calibration) -> Figure:
    """Points are trials, marked by role; lines are simulated; the shaded ranges were not fitted."""
    figure, axes = panel(HALF_WIDTH_IN, 3.88, Margins(top=0.9))
    sweep = calibration.sweep
    _shade_extrapolated(axes, sweep)
    _curves(axes, sweep)
    for trial in calibration.trials:
        theory = [(model_colour(name), trial.speeds[name]) for name in _THEORY]
        for colour, speed in (*theory, (TWIN, trial.speed_twin), (INK, trial.measured.speed)):
            axes.plot(trial.measured.frequency.hz, speed * MM, **role_marker(colour, trial.measured.role))
    axes.set(xlabel="swim frequency (Hz)", ylabel="forward speed (mm/s)")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _legend(axes)
    return figure


def _shade_extrapolated(axes: Axes, sweep: SpeedSweep) -> None:
    low, high = sweep.fitted_hz
    first, last = float(np.min(sweep.frequency_hz)), float(np.max(sweep.frequency_hz))
    axes.set_xlim(min(first, low), max(last, high))
    for start, end in ((first, low), (high, last)):
        if start < end:
            axes.axvspan(start, end, facecolor=SHADE, linewidth=0)
    for limit in (low, high):
        axes.axvline(limit, color=MUTED, linewidth=0.7, linestyle=(0, (2, 2)))


def _curves(axes: Axes, sweep: SpeedSweep) -> None:
    """Solid where trials were fitted, dashed beyond."""
    low, high = sweep.fitted_hz
    edges = np.linspace(low, high, 40)
    theory = [(sweep.ebt[name], model_colour(name), 1.0) for name in _THEORY]
    for speed, colour, width in (*theory, (sweep.speed_twin, TWIN, 1.6)):
        axes.plot(sweep.frequency_hz, speed * MM, color=colour, linewidth=width, linestyle=(0, (4, 2)))
        inside = np.interp(edges, sweep.frequency_hz, speed) * MM
        axes.plot(edges, inside, color=colour, linewidth=width)


def _legend(axes: Axes) -> None:
    models = [(model_colour(name), model_label(name), 1.4) for name in ("twin", *_THEORY)]
    handles = [
        Line2D([], [], color=colour, linewidth=width, marker="s", markersize=4.5, label=text)
        for colour, text, width in ((INK, "measured", 0.0), *models)
    ]
    beyond = Line2D([], [], color=MUTED, linestyle=(0, (4, 2)), label="extrapolated")
    above: dict[str, Any] = {"loc": "lower left", "handlelength": 1.3, "columnspacing": 0.9, "borderpad": 0.0}
    axes.add_artist(axes.legend(handles=handles, bbox_to_anchor=(-0.12, 1.11), ncols=3, handletextpad=0.4, **above))
    axes.legend(handles=[*role_handles(MUTED), beyond], bbox_to_anchor=(-0.12, 1.03), ncols=3, **above)


@styled
def speed_errors_figure(calibration: Calibration) -> Figure:
    """Predicted minus measured speed, a row for each trial, fastest on top; open marks were held out."""
    trials = sorted(calibration.trials, key=lambda trial: trial.measured.frequency.hz)
    count = len(trials)
    height = min(max(1.1 + 0.52 * count, 2.2), 3.7) if count < 10 else 1.2 + 0.25 * count
    figure, axes = panel(HALF_WIDTH_IN, height, Margins(left=1.05, top=0.52))
    axes.axvline(0.0, color=INK, linewidth=0.8)
    for row, trial in enumerate(trials):
        speeds = trial.speeds
        for name, shift in _SHOWN.items():
            colour, error = model_colour(name), (speeds[name] - trial.measured.speed) * MM
            axes.plot([0.0, error], [row + shift] * 2, color=colour, linewidth=1.2)
            axes.plot(error, row + shift, **role_marker(colour, trial.measured.role))
    for name in _SHOWN:
        axes.plot([], [], color=model_colour(name), marker="s", markersize=4.5, label=model_label(name))
    axes.set_yticks(range(count), [shortened(trial.measured.name) for trial in trials])
    axes.set(ylim=(-0.6, count - 0.4), xlabel="predicted minus measured speed (mm/s)")
    legend_above(axes, 2)
    return figure
