"""The body's midline through one beat, measured and simulated."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting import CalibratedTrial
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, INK, TWIN, Margins, box, styled
from swimmer import RobotSpec

PHASES = 16
_MARGINS = Margins()
_GAP_IN = 0.26


@styled
def tail_envelope_figure(trial: CalibratedTrial, robot: RobotSpec) -> Figure:
    """Midlines at sixteen phases of the beat, to scale; dotted in both, the measured envelope."""
    measured, simulated = beat_midlines(trial, robot)  # (16, k, 2) each, mm
    both = np.concatenate([measured, simulated]) * MM
    reach = 1.15 * max(float(np.nanmax(np.abs(both[..., 1]), initial=1.0)), 20.0)
    left, right = float(np.nanmin(both[..., 0])) - 15, float(np.nanmax(both[..., 0])) + 25
    width = HALF_WIDTH_IN - _MARGINS.left - _MARGINS.right
    panel_height = width * 2 * reach / (right - left)
    height = 2 * panel_height + _GAP_IN + _MARGINS.bottom + _MARGINS.top
    figure = Figure(figsize=(HALF_WIDTH_IN, height))
    for row, (midlines, colour, title) in enumerate(((simulated, TWIN, "twin"), (measured, INK, "measured"))):
        below = _MARGINS.bottom + row * (panel_height + _GAP_IN)
        margins = _MARGINS._replace(bottom=below, top=height - below - panel_height)
        axes = figure.add_axes(box(HALF_WIDTH_IN, height, margins))
        _draw_midlines(axes, midlines * MM, colour)
        _draw_outline(axes, measured * MM)
        axes.set(xlim=(left, right), ylim=(-reach, reach), ylabel="lateral (mm)")
        axes.set_title(title, loc="left", color=colour, fontweight="bold", pad=3)
        axes.tick_params(labelbottom=row == 0)
    figure.axes[0].set_xlabel("distance behind the nose, along the head (mm)")
    return figure


def beat_midlines(trial: CalibratedTrial, robot: RobotSpec) -> tuple[np.ndarray, np.ndarray]:
    """Measured and simulated midlines, folded into one beat.

    Args:
        trial: its compared frames are used, without flagged samples.
        robot: tells which markers lie on the midline.

    Returns:
        (16, k, 2) each: the mean of k markers from nose to fin in each sixteenth of a beat, relative to the
        nose in the head frame, m; nan where no sample counts. The phase runs from the first compared frame.
    """
    measured = trial.measured
    on_midline = _midline(robot, measured.markers)
    frames = measured.kept
    time_s = measured.time_s[frames] - measured.time_s[frames][0]
    shape = measured.head.shape_m[frames][:, on_midline]
    good = (measured.weight[frames][:, on_midline] > 0) & np.isfinite(shape).all(axis=2)
    twin = trial.simulated.shape_m[frames][:, on_midline]
    return (
        _folded(time_s * measured.frequency.hz, shape, good),
        _folded(time_s * trial.simulated_hz, twin, np.isfinite(twin).all(axis=2)),
    )


def _midline(robot: RobotSpec, markers: tuple[str, ...]) -> list[int]:
    """Indices of the markers on the robot's middle plane, from nose to fin."""
    place = robot.marker_positions_m(markers)
    on_plane = np.flatnonzero(np.abs(place[:, 1]) < 0.01 * robot.length_m)
    return [int(i) for i in on_plane[np.argsort(place[on_plane, 0])]]


def _folded(beats: np.ndarray, shape_m: np.ndarray, good: np.ndarray) -> np.ndarray:
    """(16, k, 2) means of the good samples (n, k, 2) by the phase of their beat (n,)."""
    phase = np.floor(beats % 1.0 * PHASES).astype(int) % PHASES
    total = np.zeros((PHASES, *shape_m.shape[1:]))
    count = np.zeros((PHASES, shape_m.shape[1], 1))
    np.add.at(total, phase, np.where(good[..., None], shape_m, 0.0))
    np.add.at(count, phase, good[..., None])
    with np.errstate(invalid="ignore", divide="ignore"):
        return total / np.where(count > 0, count, np.nan)


def _draw_midlines(axes: Axes, midlines: np.ndarray, colour: str) -> None:
    for line in midlines:
        axes.plot(line[:, 0], line[:, 1], color=colour, linewidth=0.9, alpha=0.55)
    axes.plot(midlines[..., 0].ravel(), midlines[..., 1].ravel(), ".", color=colour, markersize=2.2, alpha=0.7)


def _draw_outline(axes: Axes, midlines: np.ndarray) -> None:
    """The envelope: the widest lateral places of each marker."""
    if np.isnan(midlines).all(axis=(0, 2)).any():
        return
    for extreme in (np.nanargmin, np.nanargmax):
        edge = midlines[extreme(midlines[..., 1], axis=0), np.arange(midlines.shape[1])]  # (k, 2)
        axes.plot(edge[:, 0], edge[:, 1], color=INK, linewidth=1.2, linestyle=(0, (1, 1.5)))
