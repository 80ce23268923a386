"""The distance swum over time."""

import numpy as np
from matplotlib.figure import Figure

from fitting import CalibratedTrial
from reports.figures.time_windows import mark_windows
from reports.numbers import MM, in_mm
from reports.style import EBT, HALF_WIDTH_IN, INK, TWIN, Margins, panel, styled


@styled
def forward_path_figure(trial: CalibratedTrial, height_in: float = 3.6) -> Figure:
    """Distance along the head's own axis, 0 at the first compared frame; the slopes are the speeds."""
    figure, axes = panel(HALF_WIDTH_IN, height_in, Margins(top=0.5))
    measured = trial.measured
    time_s, first = measured.time_s, int(np.flatnonzero(measured.kept)[0])
    mark_windows(axes, measured)
    since = time_s[measured.kept] - time_s[first]
    steady = trial.speed_ebt * since * MM
    label = f"EBT, {in_mm(trial.speed_ebt, 0)} mm/s"
    axes.plot(time_s[measured.kept], steady, color=EBT, linestyle=(0, (4, 2)), linewidth=1.2, label=label)
    for path_m, colour, name, speed in (
        (measured.head.forward_m, INK, "measured", measured.speed),
        (trial.simulated.forward_m, TWIN, "twin", trial.speed_twin),
    ):
        label = f"{name}, {in_mm(speed, 0)} mm/s"
        axes.plot(time_s, (path_m - path_m[first]) * MM, color=colour, label=label)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("distance swum (mm)")
    handles, labels = axes.get_legend_handles_labels()
    order = [1, 2, 0]
    axes.legend(
        [handles[i] for i in order],
        [labels[i] for i in order],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.03),
        ncols=2,
    )
    return figure
