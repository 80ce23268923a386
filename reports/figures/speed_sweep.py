"""Speed over frequency: what was measured, what the twin does, and what elongated body theory says."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import Calibration, SpeedSweep
from reports.figures.role_marker import role_marker
from reports.numbers import MM
from reports.style import EBT, HALF_WIDTH_IN, INK, MUTED, SHADE, TWIN, Margins, panel, styled


@styled
def speed_sweep_figure(calibration: Calibration) -> Figure:
    """Points are trials, told apart by role; lines are simulated; the shaded ranges were not fitted."""
    figure, axes = panel(HALF_WIDTH_IN, 3.5, Margins(top=0.72))
    sweep = calibration.sweep
    _shade_extrapolated(axes, sweep)
    _curves(axes, sweep)
    for trial in calibration.trials:
        speeds = {EBT: trial.speed_ebt, TWIN: trial.speed_twin, INK: trial.measured.speed}
        for colour, speed in speeds.items():
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
    for speed, colour, width in ((sweep.speed_ebt, EBT, 1.0), (sweep.speed_twin, TWIN, 1.6)):
        axes.plot(sweep.frequency_hz, speed * MM, color=colour, linewidth=width, linestyle=(0, (4, 2)))
        inside = np.interp(edges, sweep.frequency_hz, speed) * MM
        axes.plot(edges, inside, color=colour, linewidth=width)


def _legend(axes: Axes) -> None:
    colours = ((INK, "measured", 0.0), (TWIN, "twin", 1.4), (EBT, "elongated body theory", 1.4))
    handles = [
        Line2D([], [], color=colour, linewidth=width, marker="s", markersize=4.5, label=text)
        for colour, text, width in colours
    ]
    roles = (("fit", "fit trial"), ("holdout", "held-out trial"))
    marks = [Line2D([], [], label=text, **role_marker(MUTED, role)) for role, text in roles]
    beyond = Line2D([], [], color=MUTED, linestyle=(0, (4, 2)), label="extrapolated")
    axes.add_artist(axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.1), ncols=3))
    axes.legend(handles=[*marks, beyond], loc="lower left", bbox_to_anchor=(0.0, 1.01), ncols=3)
