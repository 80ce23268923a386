"""How far the twin is from each trial as time goes on."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import CalibratedTrial, MeasuredTrial, residuals
from reports.figures.time_windows import runs
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, INK, MUTED, TWIN, Grid, Margins, legend_on_top, panels, styled


@styled
def residuals_over_time_figure(trials: Sequence[CalibratedTrial]) -> Figure:
    """A row for each trial: distance from frame to frame, mean over markers that count, from the first kept frame."""
    height = 0.62 if len(trials) < 8 else 0.42
    figure, drawn = panels(len(trials), Grid(1, height, gap_in=(0.0, 0.27)), HALF_WIDTH_IN, Margins(left=0.5, top=0.5))
    longest = max(float(np.ptp(trial.measured.time_s[trial.measured.kept])) for trial in trials)
    for number, (axes, trial) in enumerate(zip(drawn, trials, strict=True)):
        time_s, distance, shape = distances_over_time(trial)
        axes.plot(time_s, distance * MM, color=TWIN, linewidth=1.2)
        axes.plot(time_s, shape * MM, color=INK, linewidth=0.9)
        _mark_scored(axes, trial.measured)
        axes.set(xlim=(0.0, longest))
        axes.set_ylim(0.0, 1.15 * axes.get_ylim()[1])
        axes.set_title(shortened(trial.measured.name, 40), loc="left", fontweight="bold", pad=3)
        axes.tick_params(labelbottom=number == len(trials) - 1)
        axes.locator_params(axis="y", nbins=3)
    drawn[-1].set_xlabel("time since the first compared frame (s)")
    drawn[len(drawn) // 2].set_ylabel("distance (mm)")
    legend_on_top(
        figure,
        [
            Line2D([], [], color=TWIN, label="distance"),
            Line2D([], [], color=INK, linewidth=0.9, label="shape alone"),
            Line2D([], [], color=MUTED, linewidth=2.5, label="scored window"),
        ],
        3,
    )
    return figure


def distances_over_time(trial: CalibratedTrial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(k,) each over the kept frames: time since the first (s), mean distance over markers, that of the shape (m).

    Flagged samples are left out; a frame of which nothing counts is nan.
    """
    measured, frames = trial.measured, trial.measured.kept
    distance = np.linalg.norm(residuals(measured, trial.simulated, frames), axis=-1)  # (k, m)
    shape = np.linalg.norm(trial.simulated.shape_m[frames] - measured.head.shape_m[frames], axis=-1)
    good = (measured.weight[frames] > 0) & np.isfinite(distance)
    count = np.where(good.any(axis=1), good.sum(axis=1), np.nan)
    over_markers = (np.where(good, values, 0.0).sum(axis=1) / count for values in (distance, shape))
    time_s = measured.time_s[frames]
    return (time_s - time_s[0], *over_markers)


def _mark_scored(axes: Axes, trial: MeasuredTrial) -> None:
    across, start = axes.get_xaxis_transform(), trial.time_s[trial.kept][0]
    for first, last in runs(trial.scored):
        axes.plot(trial.time_s[[first, last]] - start, [0.96, 0.96], color=MUTED, linewidth=2.5, transform=across)
