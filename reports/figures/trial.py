"""The figures of one trial and its twin: the midline through a beat, the distance swum, the tail's motion over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting import CalibratedTrial, MeasuredTrial
from fitting.in_pool import tail_markers
from reports.colours import EBT, INK, MUTED, SHADE, TWIN, WARN
from reports.numbers import MM, in_mm, shortened
from reports.style import (
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    MARGINS,
    Grid,
    Look,
    Margins,
    legend_above,
    panel,
    panels,
    styled,
)
from swimmer import RobotSpec
from tracking.stretches import stretches

PHASES = 16
_MOST_ROWS = 6  # largest number of markers that are drawn


@styled
def tail_envelope_figure(trial: CalibratedTrial, robot: RobotSpec) -> Figure:
    """Draw midlines at sixteen phases of the beat, to scale; dotted in both panels, the measured envelope."""
    measured, simulated = (midlines * MM for midlines in beat_midlines(trial, robot))  # (16, k, 2) each
    both = np.concatenate([measured, simulated])
    reach = 1.15 * max(float(np.nanmax(np.abs(both[..., 1]), initial=1.0)), 20.0)
    left, right = float(np.nanmin(both[..., 0])) - 15, float(np.nanmax(both[..., 0])) + 25
    height = (HALF_WIDTH_IN - MARGINS.left - MARGINS.right) * 2 * reach / (right - left)
    figure, (above, below) = panels(2, Grid(1, height, (0.0, 0.26)), HALF_WIDTH_IN)
    for axes, midlines, colour, title in ((above, measured, INK, "measured"), (below, simulated, TWIN, "twin")):
        axes.plot(*midlines.transpose(2, 1, 0), color=colour, linewidth=0.9, alpha=0.55)
        axes.plot(midlines[..., 0].ravel(), midlines[..., 1].ravel(), ".", color=colour, markersize=2.2, alpha=0.7)
        _draw_outline(axes, measured)
        axes.set(xlim=(left, right), ylim=(-reach, reach), ylabel="lateral (mm)")
        axes.set_title(title, loc="left", color=colour, fontweight="bold", pad=3)
    above.tick_params(labelbottom=False)
    below.set_xlabel("distance behind the nose, along the head (mm)")
    return figure


def _draw_outline(axes: Axes, midlines: np.ndarray) -> None:
    if np.isnan(midlines).all(axis=(0, 2)).any():
        return
    for extreme in (np.nanargmin, np.nanargmax):
        edge = midlines[extreme(midlines[..., 1], axis=0), np.arange(midlines.shape[1])]  # (k, 2)
        axes.plot(edge[:, 0], edge[:, 1], color=INK, linewidth=1.2, linestyle=(0, (1, 1.5)))


def beat_midlines(trial: CalibratedTrial, robot: RobotSpec) -> tuple[np.ndarray, np.ndarray]:
    """Fold measured and simulated midlines into one beat, over the compared frames, without flagged samples.

    Returns:
        (16, k, 2) each: the mean of k markers from nose to fin in each sixteenth of a beat, relative to the nose in the
            head frame, m; nan where no sample counts. The phase runs from the first compared frame.
    """
    measured = trial.measured
    place = robot.marker_positions_m(measured.markers)
    on_plane = np.flatnonzero(np.abs(place[:, 1]) < 0.01 * robot.length_m)
    on_midline = on_plane[np.argsort(place[on_plane, 0])]
    frames = measured.kept
    time_s = measured.time_s[frames] - measured.time_s[frames][0]
    shape = measured.head.shape_m[frames][:, on_midline]
    good = (measured.weight[frames][:, on_midline] > 0) & np.isfinite(shape).all(axis=2)
    twin = trial.simulated.shape_m[frames][:, on_midline]
    return (
        _fold(time_s * measured.frequency.hz, shape, good),
        _fold(time_s * trial.simulated_hz, twin, np.isfinite(twin).all(axis=2)),
    )


def _fold(beats: np.ndarray, shape_m: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Average the good samples (n, k, 2) by the phase of their beat (n,), to (16, k, 2)."""
    phase = np.floor(beats % 1.0 * PHASES).astype(int) % PHASES
    total = np.zeros((PHASES, *shape_m.shape[1:]))
    count = np.zeros((PHASES, shape_m.shape[1], 1))
    np.add.at(total, phase, np.where(good[..., None], shape_m, 0.0))
    np.add.at(count, phase, good[..., None])
    with np.errstate(invalid="ignore", divide="ignore"):
        return total / np.where(count > 0, count, np.nan)


@styled
def forward_path_figure(trial: CalibratedTrial) -> Figure:
    """Draw the distance along the head's own axis, 0 at the first compared frame; the slopes are the speeds."""
    figure, axes = panel(HALF_WIDTH_IN, 3.6, Margins(top=0.5))
    measured = trial.measured
    time_s, first = measured.time_s, int(np.flatnonzero(measured.kept)[0])
    for path_m, colour, name, speed in (
        (measured.head.forward_m, INK, "measured", measured.speed),
        (trial.simulated.forward_m, TWIN, "twin", trial.speed_twin),
    ):
        label = f"{name}, {in_mm(speed, 0)} mm/s"
        axes.plot(time_s, (path_m - path_m[first]) * MM, color=colour, label=label)
    since = time_s[measured.kept] - time_s[first]
    dashed: Look = {"linestyle": (0, (4, 2)), "linewidth": 1.2, "zorder": 1.9}
    label = f"EBT, {in_mm(trial.speed_ebt, 0)} mm/s"
    axes.plot(time_s[measured.kept], trial.speed_ebt * since * MM, color=EBT, label=label, **dashed)
    _mark_windows(axes, measured)
    axes.set(xlabel="time (s)", ylabel="distance swum (mm)")
    legend_above(axes, 2)
    return figure


@styled
def lateral_motion_figure(trial: CalibratedTrial, robot: RobotSpec) -> Figure:
    """Draw a row for each tail marker, all to one scale; flagged samples are marked and do not count."""
    tail = tail_markers(robot, trial.measured.markers)
    spread = np.unique(np.linspace(0, len(tail) - 1, min(len(tail), _MOST_ROWS)).round().astype(int))
    chosen = [tail[i] for i in spread]  # from the root to the fin
    lateral = trial.measured.head.shape_m[:, chosen, 1] * MM  # (n, r)
    twin = trial.simulated.shape_m[:, chosen, 1] * MM
    good = trial.measured.weight[:, chosen] > 0
    reach = _reach(np.concatenate([np.where(good, lateral, np.nan), twin]))  # (r,)
    step = 0.95 * float(reach.max())
    figure, axes = panel(FULL_WIDTH_IN, 1.1 + 0.5 * len(chosen), Margins(left=0.85, right=0.62))
    offsets = -step * np.arange(len(chosen))
    for row, offset in enumerate(offsets):
        _draw_row(axes, trial.measured.time_s, lateral[:, row] + offset, good[:, row])
        axes.plot(trial.measured.time_s, twin[:, row] + offset, color=TWIN, linewidth=1.1, label="twin")
    _mark_windows(axes, trial.measured)
    axes.set_yticks(offsets, [shortened(trial.measured.markers[i], 12) for i in chosen])
    axes.set(ylim=(offsets[-1] - 1.1 * reach[-1], 1.1 * reach[0] + 0.4 * step), xlabel="time (s)")
    _scale_bar(axes, offsets[-1], step)
    legend_above(axes, 4)
    return figure


def _reach(lateral: np.ndarray) -> np.ndarray:
    """Compute (r,) how far each marker of (n, r) swings to either side, outliers left out, mm; at least 5."""
    seen = np.where(np.isfinite(lateral), np.abs(lateral), 0.0)
    return np.maximum(np.percentile(seen, 99.5, axis=0), 5.0)


def _draw_row(axes: Axes, time_s: np.ndarray, value: np.ndarray, good: np.ndarray) -> None:
    axes.plot(time_s, np.where(good, value, np.nan), color=INK, linewidth=1.1, label="measured")
    style: Look = {"color": WARN, "linewidth": 2.2, "solid_capstyle": "round", "zorder": 1.5}
    for first, last in stretches(~good & np.isfinite(value)):
        stretch = slice(max(first - 1, 0), last + 2)
        axes.plot(time_s[stretch], value[stretch], label="flagged, left out", **style)


def _scale_bar(axes: Axes, offset: float, step: float) -> None:
    length = next(size for size in (500, 200, 100, 50, 20, 10, 5) if size <= step or size == 5)
    right, ends = axes.get_yaxis_transform(), [offset - length / 2, offset + length / 2]
    axes.plot([1.012, 1.012], ends, color=MUTED, linewidth=1.5, transform=right, clip_on=False)
    axes.text(1.02, offset, f"{length} mm", transform=right, va="center", fontsize=7)


def _mark_windows(axes: Axes, trial: MeasuredTrial) -> None:
    """Shade what is not compared (warm-up; known part of a held-out trial) and mark the scored frames."""
    for first, last in stretches(~trial.kept):
        end_s = trial.time_s[min(last + 1, len(trial.time_s) - 1)]
        axes.axvspan(trial.time_s[first], end_s, facecolor=SHADE, linewidth=0)
    mark_scored(axes, trial, 0.0)
    axes.set_xlim(trial.time_s[0], trial.time_s[-1])


def mark_scored(axes: Axes, trial: MeasuredTrial, zero_s: float, height: float = 0.985) -> None:
    """Draw a bar on top of the scored frames.

    Args:
        axes: the panel.
        trial: the trial.
        zero_s: time of the trial at which the axis begins, s.
        height: place of the bar as a share of the panel's height.
    """
    across = axes.get_xaxis_transform()
    for first, last in stretches(trial.scored):
        ends = trial.time_s[[first, last]] - zero_s
        axes.plot(ends, [height, height], color=MUTED, linewidth=2.5, transform=across, label="scored window")
