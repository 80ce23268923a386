"""The tail markers' lateral motion over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting import CalibratedTrial, tail_markers
from reports.figures.time_windows import mark_windows, runs
from reports.numbers import MM, shortened
from reports.style import FULL_WIDTH_IN, INK, MUTED, TWIN, WARN, Margins, legend_above, panel, styled
from swimmer import RobotSpec

MOST_ROWS = 6


@styled
def lateral_motion_figure(trial: CalibratedTrial, robot: RobotSpec) -> Figure:
    """One row a tail marker, all to one scale; flagged samples stand out and do not count."""
    chosen = _rows(trial, robot)
    lateral = trial.measured.head.shape_m[:, chosen, 1] * MM  # (n, r)
    twin = trial.simulated.shape_m[:, chosen, 1] * MM
    good = trial.measured.weight[:, chosen] > 0
    reach = _reach(np.concatenate([np.where(good, lateral, np.nan), twin]))  # (r,)
    step = 0.95 * float(reach.max())
    figure, axes = panel(FULL_WIDTH_IN, 1.1 + 0.5 * len(chosen), Margins(left=0.85, right=0.62))
    mark_windows(axes, trial.measured)
    for row, offset in enumerate(-step * np.arange(len(chosen))):
        _draw_row(axes, trial.measured.time_s, lateral[:, row] + offset, good[:, row])
        axes.plot(trial.measured.time_s, twin[:, row] + offset, color=TWIN, linewidth=1.1)
    names = [shortened(trial.measured.markers[i], 12) for i in chosen]
    axes.set_yticks(-step * np.arange(len(chosen)), names)
    axes.set_ylim(offset - 1.1 * reach[-1], 1.1 * reach[0] + 0.4 * step)
    axes.set_xlabel("time (s)")
    _scale_bar(axes, offset, step)
    _legend(axes, trial)
    return figure


def _rows(trial: CalibratedTrial, robot: RobotSpec) -> list[int]:
    """Indices of at most six tail markers, spread from the root to the fin."""
    tail = tail_markers(robot, trial.measured.markers)
    spread = np.unique(np.linspace(0, len(tail) - 1, min(len(tail), MOST_ROWS)).round().astype(int))
    return [tail[i] for i in spread]


def _reach(lateral: np.ndarray) -> np.ndarray:
    """(r,) how far each marker of (n, r) goes to either side, outliers apart, mm; at least 5."""
    seen = np.where(np.isfinite(lateral), np.abs(lateral), 0.0)
    return np.maximum(np.percentile(seen, 99.5, axis=0), 5.0)


def _draw_row(axes: Axes, time_s: np.ndarray, value: np.ndarray, good: np.ndarray) -> None:
    axes.plot(time_s, np.where(good, value, np.nan), color=INK, linewidth=1.1)
    for first, last in runs(~good & np.isfinite(value)):
        stretch = slice(max(first - 1, 0), last + 2)
        axes.plot(time_s[stretch], value[stretch], color=WARN, linewidth=2.2, solid_capstyle="round", zorder=1.5)


def _scale_bar(axes: Axes, offset: float, step: float) -> None:
    length = next(size for size in (500, 200, 100, 50, 20, 10, 5) if size <= step or size == 5)
    right, ends = axes.get_yaxis_transform(), [offset - length / 2, offset + length / 2]
    axes.plot([1.012, 1.012], ends, color=MUTED, linewidth=1.5, transform=right, clip_on=False)
    axes.text(1.02, offset, f"{length} mm", transform=right, va="center", fontsize=7)


def _legend(axes: Axes, trial: CalibratedTrial) -> None:
    axes.plot([], [], color=INK, label="measured")
    axes.plot([], [], color=TWIN, label="twin")
    if (trial.measured.weight <= 0).any():
        axes.plot([], [], color=WARN, linewidth=2.2, label="flagged, left out")
    axes.plot([], [], color=MUTED, linewidth=2.5, label="scored window")
    legend_above(axes, 4)
