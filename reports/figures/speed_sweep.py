"""Speed over frequency: what was measured, what the twin does, and what elongated body theory says."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import Calibration, SpeedSweep
from reports.figures.role_marker import role_marker
from reports.models import model_colour, model_label
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, INK, MUTED, SHADE, TWIN, Margins, panel, styled

_THEORY = ("published", "smoothed", "large")


@styled
def speed_sweep_figure(calibration: Calibration) -> Figure:
    """Points are trials, told apart by role; lines are simulated; the shaded ranges were not fitted."""
    figure, axes = panel(HALF_WIDTH_IN, 3.88, Margins(top=0.9))
    sweep = calibration.sweep
    _shade_extrapolated(axes, sweep)
    _curves(axes, sweep)
    for trial in calibration.trials:
        theory = [(model_colour(name), trial.speeds[name]) for name in _THEORY]
        for colour, speed in (*theory, (TWIN, trial.speed_twin), (INK, trial.measured.speed)):
            axes.plot(trial.measured.frequency.hz, speed * MM, **role_marker(colour, trial.measured.role))
    axes.set_xlabel("swim frequency (Hz)")
    axes.set_ylabel("forward speed (mm/s)")
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
    roles = (("fit", "fit trial"), ("holdout", "held-out trial"))
    marks = [Line2D([], [], label=text, **role_marker(MUTED, role)) for role, text in roles]
    beyond = Line2D([], [], color=MUTED, linestyle=(0, (4, 2)), label="extrapolated")
    above: dict[str, Any] = {"loc": "lower left", "handlelength": 1.3, "columnspacing": 0.9, "borderpad": 0.0}
    axes.add_artist(axes.legend(handles=handles, bbox_to_anchor=(-0.12, 1.11), ncols=3, handletextpad=0.4, **above))
    axes.legend(handles=[*marks, beyond], bbox_to_anchor=(-0.12, 1.03), ncols=3, **above)
