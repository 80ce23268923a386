"""Which part of a trial is compared: shading that all figures over time share."""

import numpy as np
from matplotlib.axes import Axes

from fitting import MeasuredTrial
from reports.style import MUTED, SHADE


def mark_windows(axes: Axes, trial: MeasuredTrial) -> None:
    """Shades what is not compared (warm-up; known part of a held-out trial) and marks the scored frames."""
    for first, last in runs(~trial.kept):
        axes.axvspan(trial.time_s[first], _end(trial.time_s, last), facecolor=SHADE, linewidth=0)
    for first, last in runs(trial.scored):
        across = axes.get_xaxis_transform()
        axes.plot(trial.time_s[[first, last]], [0.985, 0.985], color=MUTED, linewidth=2.5, transform=across)
    axes.set_xlim(trial.time_s[0], trial.time_s[-1])


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and last index, both included, of each unbroken run of True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def _end(time_s: np.ndarray, last: int) -> float:
    return float(time_s[min(last + 1, len(time_s) - 1)])
