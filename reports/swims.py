"""Sections on swims, with their figures: the motion of each trial, its residuals by marker, the beat of its tail."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.calibration import CalibratedTrial
from fitting.ebt import BodyWave, SwimNumbers, body_wave, simulated_numbers, swim_numbers
from fitting.phase import residuals
from fitting.pool import tail_markers
from fitting.trial import MeasuredTrial
from reports.context import ReportContext
from reports.first_screen import representative
from reports.page import Plot, Plots, Prose, Section, Table, table_head
from reports.style import (
    EBT,
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    INK,
    MARGINS,
    MUTED,
    SHADE,
    TWIN,
    WARN,
    Grid,
    Look,
    Margins,
    legend_above,
    legend_on_top,
    name_panels,
    panel,
    panels,
    styled,
)
from reports.words import MISSING, MM, counted, in_mm, in_words, listed, percent, shortened, shown, significant
from swimcal.robot import RobotSpec
from tracking.harmed_frames import stretches

# Motion
PHASES = 16  # phases of a beat at which midlines are drawn
_MOST_ROWS = 6  # largest number of markers that are drawn

# Residuals
_MOST_COLUMNS = 6  # panels in a row of the page
_IN_HALF = 3  # panels in a row of half the page
TRUSTED = 0.9  # share of a marker's samples below which its bar is marked

# A trial drifts if its marker distance is more than this many times that of the shape alone.
DRIFTING = 2.0

# The beat of the tail
COLUMNS = table_head(
    "trial | swimming number [measured, 10³] | twin [10³] | Reynolds [measured, 10³] | twin [10³] | "
    "Strouhal [measured] | twin []"
)
LEAST_SEEN = 0.7  # share of a marker's samples needed for its beat; gaps come back at one phase of the beat


# The motion of each trial.


class MidlineAxes(NamedTuple):
    """Ends of the axes of midlines, mm: along the head, and to either side."""

    left: float
    right: float
    reach: float

    @classmethod
    def around(cls, midlines_mm: np.ndarray) -> "MidlineAxes":
        """Leave some room around midlines (..., 2)."""
        reach = 1.15 * max(float(np.nanmax(np.abs(midlines_mm[..., 1]), initial=1.0)), 20.0)
        return cls(float(np.nanmin(midlines_mm[..., 0])) - 15, float(np.nanmax(midlines_mm[..., 0])) + 25, reach)


@styled
def tail_envelope_figure(trial: CalibratedTrial, robot: RobotSpec, frame: MidlineAxes | None = None) -> Figure:
    """Draw midlines at sixteen phases of the beat, to scale; dotted in both panels, the measured envelope.

    Args:
        trial: the trial.
        robot: its robot.
        frame: ends of the axes, mm; None: as this trial needs them.
    """
    measured, simulated = (midlines * MM for midlines in beat_midlines(trial, robot))  # (16, k, 2) each
    left, right, reach = frame or MidlineAxes.around(np.concatenate([measured, simulated]))
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
    chosen = [tail[i] for i in spread]  # markers run from the root to the fin
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
    for first, last in stretches(trial.scored):
        on_top: Look = {"transform": axes.get_xaxis_transform(), "label": "scored window"}
        axes.plot(trial.time_s[[first, last]], [0.985, 0.985], color=MUTED, linewidth=2.5, **on_top)
    axes.set_xlim(trial.time_s[0], trial.time_s[-1])


def build_trials(context: ReportContext) -> Section:
    """Build the section: envelopes of all trials; over time only the trial of the first screen."""
    robot, trials = context.calibration.robot, context.calibration.trials
    text = (
        "Midlines through the beat in the frame of the head, to scale, robot above twin; dotted in both: the robot’s "
        "envelope."
    )
    midlines = [MM * each.reshape(-1, 2) for trial in trials for each in beat_midlines(trial, robot)]
    frame = MidlineAxes.around(np.concatenate(midlines))
    blocks = [Plots(tuple(_envelope(trial, robot, frame) for trial in trials), text)]
    if (chosen := representative(trials, robot)) is not None:
        blocks.append(Plots(_motion(chosen, robot)[1:]))  # the path alone shows no difference
    return Section("The body through the beat", "trials", tuple(blocks))


def trial_plots(trial: CalibratedTrial, robot: RobotSpec) -> dict[str, Plot]:
    """Draw envelope, path and lateral motion of one trial, by the figure's name."""
    return {plot.name: plot for plot in (_envelope(trial, robot), *_motion(trial, robot))}


def build_motions(context: ReportContext) -> Section:
    """Build a section with the motion of every trial over time: for notebooks, too much for a page."""
    plots = [plot for trial in context.calibration.trials for plot in _motion(trial, context.calibration.robot)]
    return Section("Trials over time", "motions", (Plots(tuple(plots)),))


def _label(trial: CalibratedTrial) -> str:
    measured = trial.measured
    role = "fitted" if measured.role == "fit" else "held out"
    return f"{measured.name}, {shown(measured.frequency.hz, 2)} Hz, {role}"


def _envelope(trial: CalibratedTrial, robot: RobotSpec, frame: MidlineAxes | None = None) -> Plot:
    measured, simulated = beat_midlines(trial, robot)
    sweep = f"the fin sweeps {_sweep(measured)} mm, the twin’s {_sweep(simulated)} mm"
    return Plot(
        tail_envelope_figure(trial, robot, frame),
        f"{trial.measured.name}-envelope",
        f"Midlines at sixteen phases of the beat, mean over all compared beats, to scale; {sweep}.",
        label=f"{_label(trial)}.",
    )


def _motion(trial: CalibratedTrial, robot: RobotSpec) -> tuple[Plot, Plot]:
    name = trial.measured.name
    path = Plot(
        forward_path_figure(trial),
        f"{name}-path",
        f"{_label(trial)}: distance swum along the head’s own axis. On grey ground nothing is compared.",
    )
    lateral = Plot(
        lateral_motion_figure(trial, robot),
        f"{name}-lateral",
        f"{_label(trial)}: lateral motion of the tail, from root (top) to fin. A growing lag is an error of frequency.",
    )
    return path, lateral


def _sweep(midlines_m: np.ndarray) -> str:
    """Compute how far the last marker sweeps from side to side, mm."""
    tip = midlines_m[:, -1, 1]
    return MISSING if np.isnan(tip).all() else in_mm(float(np.nanmax(tip) - np.nanmin(tip)), 0)


# Its residuals by marker.


@styled
def marker_residuals_figure(trials: Sequence[CalibratedTrial]) -> Figure:
    """Draw the mean distance by marker over the scored window, and that of the shape alone, a panel a trial."""
    rows = max(len(trial.measured.markers) for trial in trials)
    columns = min(len(trials), _MOST_COLUMNS)
    width = HALF_WIDTH_IN if columns <= _IN_HALF else FULL_WIDTH_IN
    figure, drawn = panels(len(trials), Grid(columns, 0.15 + 0.135 * rows), width, Margins(left=0.78, top=0.5))
    distances = [marker_distances(trial) for trial in trials]
    reach = np.nanmax([*(np.nan_to_num(distance).max() for distance, *_ in distances), 1e-3]) * MM
    for axes, trial, columns_of in zip(drawn, trials, distances, strict=True):
        _draw(axes, trial.measured.markers, *columns_of, reach)
        axes.tick_params(length=0, labelsize=6.5)
    name_panels(drawn, [shortened(trial.measured.name, 16) for trial in trials], columns, "mm")
    legend_on_top(figure, 2)
    return figure


def marker_distances(trial: CalibratedTrial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the mean distances by marker over the scored frames of (n, m) samples, flagged ones left out.

    Returns:
        The mean distance in the head frame (m,), m, that of the shape alone (m,), m, and the share of samples that
            count (m,). Means are nan for a marker of which nothing counts.
    """
    measured, simulated, scored = trial.measured, trial.simulated, trial.measured.scored
    distance = np.linalg.norm(residuals(measured, simulated, scored), axis=-1)  # (k, m)
    shape = np.linalg.norm(simulated.shape_m[scored] - measured.head.shape_m[scored], axis=-1)
    good = (measured.own_weight[scored] > 0) & np.isfinite(distance)
    with_head = good & (measured.weight[scored] > 0)

    def mean(values: np.ndarray, counts: np.ndarray) -> np.ndarray:
        known = np.where(counts.any(axis=0), counts.sum(axis=0), np.nan)
        return np.asarray(np.where(counts, values, 0.0).sum(axis=0) / known)

    return mean(distance, good), mean(shape, with_head), good.sum(axis=0) / max(scored.sum(), 1)


def _draw(
    axes: Axes, markers: tuple[str, ...], distance: np.ndarray, shape: np.ndarray, share: np.ndarray, reach: float
) -> None:
    rows = -np.arange(len(markers))
    axes.barh(rows, 1.3 * reach, height=0.7, color=SHADE)
    axes.barh(rows, distance * MM, height=0.7, color=TWIN, label="mean distance")
    axes.plot(shape * MM, rows, "|", color=INK, markersize=6, markeredgewidth=1.4, label="shape alone")
    for row, used in zip(rows.tolist(), share, strict=True):
        if used < TRUSTED:
            text = f"{used:.0%}".replace("%", " %")
            axes.text(1.28 * reach, row, text, color=WARN, fontsize=6.5, va="center_baseline", ha="right")
    axes.set(xlim=(0.0, 1.3 * reach), ylim=(-len(markers) + 0.4, 0.6))
    axes.set_yticks(rows, [shortened(in_words(name), 11) for name in markers])
    axes.grid(visible=False, axis="y")
    axes.locator_params(axis="x", nbins=3)


def build_residuals(context: ReportContext) -> Section:
    """Build the section: distances by marker, and what they say about shape and path."""
    trials = context.calibration.trials
    plots = (
        Plot(
            marker_residuals_figure(trials),
            "residual-markers",
            "Mean distance of each marker from the twin’s; the tick: relative to the nose. A long bar with a short "
            f"tick is an error of the path, not of the shape.{_explain_percentages(trials)}",
        ),
    )
    return Section(
        "Marker by marker", "residuals", (Plots(plots), Prose(_describe_worst(trials))), _residual_caveats(trials)
    )


def _explain_percentages(trials: tuple[CalibratedTrial, ...]) -> str:
    """Explain the percentages in the figure; empty where it has none."""
    if all((marker_distances(trial)[2] >= TRUSTED).all() for trial in trials):
        return ""
    return f" Percentages: less than {TRUSTED * 100:.0f} % of the marker’s samples count."


def _describe_worst(trials: tuple[CalibratedTrial, ...]) -> str:
    """Say which marker is worst, and which trials drift rather than bend differently."""
    worst: dict[str, list[float]] = {}
    for trial in trials:
        for name, value in zip(trial.measured.markers, marker_distances(trial)[0], strict=True):
            worst.setdefault(name, []).append(float(value))
    means = {name: float(np.mean(values)) for name, values in worst.items() if np.isfinite(values).all()}
    if not means:
        return "In no trial do all markers have samples that count, so no marker is singled out."
    farthest, nearest = max(means, key=lambda name: means[name]), min(means, key=lambda name: means[name])
    drifting = [t.measured.name for t in trials if t.scores.marker_error_m > DRIFTING * t.scores.shape_error_m]
    text = (
        f"Over all trials {farthest} is farthest off ({in_mm(means[farthest])} mm on average), {nearest} nearest "
        f"({in_mm(means[nearest])} mm). "
    )
    if not drifting:
        return text + "In no trial is the distance more than twice that of the shape alone."
    return text + (
        f"In {listed(drifting)} the distance is more than twice that of the shape alone: mostly an error of the path "
        "(speed and heading)."
    )


def _residual_caveats(trials: tuple[CalibratedTrial, ...]) -> tuple[str, ...]:
    lost = [
        f"{name} of {trial.measured.name} ({percent(float(share))})"
        for trial in trials
        for name, share in zip(trial.measured.markers, marker_distances(trial)[2], strict=True)
        if share < 0.5
    ]
    return (f"Less than half of the scored samples count for {listed(lost)}.",) if lost else ()


# The beat of its tail.


def build_tail_beat(context: ReportContext) -> Section:
    """Build the section: waves and numbers, measured and simulated."""
    trials, robot = context.calibration.trials, context.calibration.robot
    waves = [_measured_wave(trial) for trial in trials]
    numbers = [_numbers(trial, wave, robot) for trial, wave in zip(trials, waves, strict=True)]
    rows = tuple(map(_row, trials, numbers))
    table = Table(
        "Dimensionless numbers of each swim (Gazzola, Argentina and Mahadevan, Nature Physics 10, 2014); the "
        f"amplitude is that of {waves[0].markers[-1]}.",
        COLUMNS,
        rows,
        folded=True,
    )
    blocks = (table, Prose(_strouhal([measured.strouhal for measured, _ in numbers])))
    return Section("Tail beat", "tail-beat", blocks, _tail_beat_caveats(trials, waves))


def _measured_wave(trial: CalibratedTrial) -> BodyWave:
    """Compute the measured wave, which is nan for a marker that is flagged too often."""
    measured = trial.measured
    wave = body_wave(measured, measured.head)
    columns = [measured.markers.index(name) for name in wave.markers]
    known = (measured.weight[measured.kept][:, columns] > 0).mean(axis=0) >= LEAST_SEEN
    return wave._replace(amplitude_m=np.where(known, wave.amplitude_m, np.nan))


def _tail_beat_caveats(trials: tuple[CalibratedTrial, ...], waves: list[BodyWave]) -> tuple[str, ...]:
    unclear = [
        f"{name} of {trial.measured.name}"
        for trial, wave in zip(trials, waves, strict=True)
        for name, amplitude in zip(wave.markers, wave.amplitude_m, strict=True)
        if not np.isfinite(amplitude)
    ]
    if not unclear:
        return ()
    return (f"Too often flagged to estimate its beat: {listed(unclear)}; left out of the measured wave.",)


def _numbers(trial: CalibratedTrial, wave: BodyWave, robot: RobotSpec) -> tuple[SwimNumbers, SwimNumbers]:
    measured = swim_numbers(trial.measured, robot)
    if not np.isfinite(wave.amplitude_m[-1]):
        measured = measured._replace(amplitude_m=np.nan, swimming_number=np.nan, strouhal=np.nan)
    return measured, simulated_numbers(trial.measured, trial.simulated, trial.simulated_hz, robot)


def _row(trial: CalibratedTrial, numbers: tuple[SwimNumbers, SwimNumbers]) -> tuple[str, ...]:
    return (
        trial.measured.name,
        *(shown(number.swimming_number / 1000) for number in numbers),
        *(shown(number.reynolds / 1000) for number in numbers),
        *(significant(number.strouhal) for number in numbers),
    )


def _strouhal(found: list[float]) -> str:
    """Compare the Strouhal numbers of the trials, nan where one is not known, with those of animals."""
    known = [value for value in found if np.isfinite(value)]
    text = (
        "The swimming number is 2πf·aL/ν, the Reynolds number UL/ν, the Strouhal number 2fa/U: with the amplitude a of "
        "the last marker (half of its swing across the course, seen from the pool), the length L from nose to fin, and "
        "the water's ν. Swimming animals cruise at Strouhal numbers of 0.2 to 0.4 (Taylor et al., Nature 425, 2003)"
    )
    if not known:
        return f"{text}; it is not known for any trial here."
    span = significant(known[0]) if len(known) == 1 else f"{significant(min(known))} to {significant(max(known))}"
    unknown = len(found) - len(known)
    rest = f"; {counted(unknown, 'trial')} without forward speed or amplitude left out" if unknown else ""
    return f"{text}; this robot swims at {span}{rest}."
