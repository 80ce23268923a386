"""Speed over frequency with what the posterior leaves open."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from reports.figures.role_marker import role_marker
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, INK, MUTED, TWIN, Margins, panel, styled

if TYPE_CHECKING:
    from fitting import Calibration
    from fitting.posterior.findings import Findings
    from fitting.posterior.predictive import PredictedSweep


_BELOW = 0.36  # share of the height


@styled
def posterior_sweep_figure(found: Findings, calibration: Calibration) -> Figure:
    """Bands that hold 50 and 90 % of what the twin may do, and trials; below, the same beside its median."""
    figure, axes = panel(HALF_WIDTH_IN, 4.4, Margins(top=0.72))
    left, bottom, width, height = axes.get_position().bounds
    axes.set_position((left, bottom + (_BELOW + 0.04) * height, width, (0.96 - _BELOW) * height))
    beside = figure.add_axes((left, bottom, width, _BELOW * height))
    sweep = found.sweep
    middle = sweep.inner[2]
    _bands(axes, sweep, np.zeros_like(middle))
    _bands(beside, sweep, middle)
    for trial in calibration.trials:
        hz, speed = trial.measured.frequency.hz, trial.measured.speed
        mark = role_marker(INK, trial.measured.role)
        axes.plot(hz, speed * MM, **mark)
        beside.plot(hz, (speed - np.interp(hz, sweep.frequency_hz, middle)) * MM, **mark)
    for part in (axes, beside):
        for limit in calibration.sweep.fitted_hz:
            part.axvline(limit, color=MUTED, linewidth=0.7, linestyle=(0, (2, 2)))
        part.set_xlim(sweep.frequency_hz[0], sweep.frequency_hz[-1])
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.tick_params(labelbottom=False)
    axes.set_ylabel("forward speed (mm/s)")
    beside.set_ylabel("beside median")
    beside.set_xlabel("swim frequency (Hz)")
    _legend(axes)
    return figure


def _bands(axes: Axes, sweep: PredictedSweep, middle: np.ndarray) -> None:
    """The quantiles (5, f) less a speed (f,)."""
    hz, outer, inner = sweep.frequency_hz, (sweep.outer - middle) * MM, (sweep.inner - middle) * MM
    for low, high, alpha in (
        (outer[0], outer[-1], 0.16),
        (outer[1], outer[-2], 0.22),
        (inner[0], inner[-1], 0.5),
    ):
        axes.fill_between(hz, low, high, color=TWIN, alpha=alpha, linewidth=0)
    axes.plot(hz, inner[2], color=TWIN, linewidth=1.2)


def _legend(axes: Axes) -> None:
    bands = [
        Patch(facecolor=TWIN, alpha=0.7, label="coefficients, 90 %"),
        Patch(facecolor=TWIN, alpha=0.38, label="and the twin’s own error, 50 %"),
        Patch(facecolor=TWIN, alpha=0.16, label="90 %"),
    ]
    roles = (("fit", "fit trial"), ("holdout", "held-out trial"))
    marks = [Line2D([], [], label=text, **role_marker(INK, role)) for role, text in roles]
    above: dict[str, Any] = {"loc": "lower left", "columnspacing": 0.9, "handletextpad": 0.5, "borderpad": 0.0}
    axes.add_artist(axes.legend(handles=bands, bbox_to_anchor=(-0.12, 1.16), ncols=3, **above))
    axes.legend(handles=marks, bbox_to_anchor=(-0.12, 1.04), ncols=2, **above)
