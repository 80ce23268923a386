"""Sections on robot and motor, with their figures.

`build_robot` draws the robot from above and from the side. `build_structure` gives the numbers of its structure with
their sources. `build_motor` shows commanded against measured speed, how evenly the motor turns, its clock, supply and
temperature.
"""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Rectangle
from numpy.typing import ArrayLike

from fitting.structure import Source
from reports.context import BINS, LoggedTrial, ReportContext
from reports.page import Plot, Plots, Prose, Section, Table, table_head
from reports.style import (
    EBT,
    FAINT,
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    INK,
    MUTED,
    SHADE,
    SURFACE,
    TWIN,
    Grid,
    Look,
    Margins,
    add_panel,
    legend_on_top,
    name_panels,
    panels,
    small_multiples,
    styled,
)
from reports.words import (
    MISSING,
    MM,
    counted,
    in_mm,
    in_words,
    listed,
    percent,
    sentence,
    shortened,
    shown,
    significant,
    with_error,
)
from swimcal.robot import RobotSpec

# The robot
_NAMES_APART_MM = 27.0  # least distance of two slanted names
_ASIDE_MM = 20.0  # space about the robot seen from the side
_ROUNDS = 50  # iterations that move the names apart
_MARGINS = Margins(left=0.15, right=0.15, bottom=0.05, top=0.05)

SHOWN_UNITS = {"m": ("mm", MM), "N m s/rad": ("mN m s/rad", 1000.0)}
COLUMNS = table_head("number | value [± standard error] | unit | taken from")

# The motor
_MOST_TURNS = 40  # number of turns drawn of each trial
_TALL_IN = 2.2  # height of all panels together where there are one or two rows
_ROW_IN = 1.4  # height of each row where there are more
_LEAST_REACH = 1.0  # every panel reaches at least this far from the mean speed, per cent

MILLION = 1e6  # parts per million
TURNING = table_head(
    "trial | kind | commanded [turns/s] | measured [turns/s] | off command [%] | ripple [%] | clock [ahead by, s] | "
    "rate [fast by, ppm] | found by"
)
SUPPLY = table_head(
    "trial | rows [a second] | current [A, mean] | current [A, highest] | voltage [V, mean] | voltage [V, lowest] | "
    "temperature [°C, first to last] | hardware errors"
)


# The robot.


@styled
def robot_figure(robot: RobotSpec, markers: tuple[str, ...]) -> Figure:
    """Draw the robot as described, from above and from the side; the markers in use are named."""
    places = robot.marker_positions_m(markers) * MM  # (m, 3)
    half_width = max(100.0, float(places[:, 1].max()) + 75, robot.crank.anchor_offset_m * MM + 30)
    lowest, highest = _reach_up_and_down(robot, places[:, 2])
    nose = robot.markers["nose"].position_m[0] * MM
    left, right = nose - 45, nose + robot.length_m * MM + 75
    width = FULL_WIDTH_IN - _MARGINS.left - _MARGINS.right
    in_a_mm = width / (right - left)
    above, side = 2 * half_width * in_a_mm, (highest - lowest) * in_a_mm
    figure = Figure(figsize=(FULL_WIDTH_IN, above + side + _MARGINS.bottom + _MARGINS.top))
    axes = add_panel(figure, (_MARGINS.left, _MARGINS.bottom + side), (width, above))
    axes.set(xlim=(left, right), ylim=(-half_width, half_width))
    axes.set_axis_off()
    draw_head(axes, robot)
    draw_tail(axes, robot)
    _draw_tendons(axes, robot)
    _draw_markers(axes, markers, places, half_width)
    _draw_scale(axes, left, right, half_width)
    axes = add_panel(figure, (_MARGINS.left, _MARGINS.bottom), (width, side))
    axes.set(xlim=(left, right), ylim=(lowest, highest))
    axes.set_axis_off()
    _draw_side(axes, robot, places)
    axes.text(left + 8, highest, "from the side", va="top", fontsize=8, color=MUTED)
    return figure


def _reach_up_and_down(robot: RobotSpec, markers_mm: np.ndarray) -> tuple[float, float]:
    """Return the lowest and highest height that a view from the side shows, mm."""
    boxes = [(part.centre_m[2], part.half_size_m[2]) for part in robot.head.part]
    boxes += [(robot.head.fluid_centre_m[2], robot.head.fluid_half_size_m[2]), (0.0, robot.caudal_fin.span_m / 2)]
    boxes += [(0.0, segment.half_height_m) for segment in robot.tail.segment]
    lowest, highest = (max(sign * z + half for z, half in boxes) * MM for sign in (-1, 1))
    return -lowest - _ASIDE_MM, max(highest, float(markers_mm.max())) + _ASIDE_MM


def _draw_side(axes: Axes, robot: RobotSpec, places: np.ndarray) -> None:
    """Draw head, segments, fin, hinges and markers at places (m, 3) from the side, mm."""
    draw_head(axes, robot, up=2)
    _draw_segments(axes, robot, [segment.half_height_m * MM for segment in robot.tail.segment], SHADE)
    fin = robot.caudal_fin
    middle, half_chord, half_span = robot.fin_root_x_m + fin.centre_m, fin.chord_m / 2, fin.span_m / 2
    _add_box(axes, (middle * MM, 0.0), (half_chord * MM, half_span * MM), TWIN, alpha=0.35)
    axes.plot(places[:, 0], places[:, 2], "o", color=INK, mfc=SURFACE, markersize=5.5, markeredgewidth=1.4, zorder=4)


def draw_head(axes: Axes, robot: RobotSpec, face: str = SHADE, up: int = 1) -> None:
    """Draw the water that the head pushes away as an ellipse, and its massive parts, mm.

    Args:
        axes: where.
        robot: the robot.
        face: colour.
        up: the axis of the robot that points up: 1 from above, 2 from the side.
    """
    seen = [0, up]
    middle, half = np.array(robot.head.fluid_centre_m)[seen] * MM, np.array(robot.head.fluid_half_size_m)[seen] * MM
    axes.add_patch(Ellipse(tuple(middle), *(2 * half), facecolor=face, edgecolor=MUTED, linewidth=0.8))
    for part in robot.head.part:
        _add_box(axes, np.array(part.centre_m)[seen] * MM, np.array(part.half_size_m)[seen] * MM, face, alpha=0.75)


def draw_tail(axes: Axes, robot: RobotSpec, face: str = SHADE, fin: str = TWIN) -> None:
    """Draw backbone, hinges, segments and, in a colour of its own, the fin, mm."""
    reach = [max(segment.guide_offset_m, segment.thickness_m) * MM + 3 for segment in robot.tail.segment]
    _draw_segments(axes, robot, reach, face)
    end = robot.fin_root_x_m * MM
    tip = end + (robot.caudal_fin.centre_m + robot.caudal_fin.chord_m / 2) * MM
    axes.plot([end, tip], [0, 0], color=fin, linewidth=3.0, solid_capstyle="butt")


def _draw_segments(axes: Axes, robot: RobotSpec, reach_mm: Sequence[float], face: str) -> None:
    """Draw backbone, hinges and segments that reach so far to either side, mm."""
    axes.plot([robot.tail.start_m * MM, robot.fin_root_x_m * MM], [0, 0], color=MUTED, linewidth=1.0)
    for (front, rear), reach in zip(robot.segment_x_m * MM, reach_mm, strict=True):
        _add_box(axes, ((front + rear) / 2, 0.0), ((rear - front) / 2, reach), face)
    axes.plot(robot.hinge_x_m * MM, np.zeros(len(robot.hinge_x_m)), "o", color=MUTED, markersize=3.5, zorder=3)


def _add_box(axes: Axes, middle: ArrayLike, half_size: ArrayLike, face: str, alpha: float | None = None) -> None:
    """Add a box by its middle (2,) and its half sizes (2,), mm."""
    (x, y), (a, b) = np.asarray(middle, float), np.asarray(half_size, float)
    box = Rectangle((x - a, y - b), 2 * a, 2 * b, facecolor=face, edgecolor=MUTED, linewidth=0.7)
    box.set_alpha(alpha)
    axes.add_patch(box)


def _draw_tendons(axes: Axes, robot: RobotSpec) -> None:
    """Draw the tendons from the crank's anchors through the guides; they change sides where the description says so."""
    x = [robot.crank.position_m[0], *(robot.segment_x_m[:, 1] - robot.tail.guide_inset_m)]
    y = [robot.crank.anchor_offset_m]
    y += [(-1 if s.tendon_crosses else 1) * s.guide_offset_m for s in robot.tail.segment]
    for side in (-1, 1):
        axes.plot(np.array(x) * MM, side * np.array(y) * MM, color=EBT, linewidth=0.9, zorder=2.5)
        axes.plot(x[0] * MM, side * y[0] * MM, "s", color=EBT, markersize=4, zorder=3)


def _draw_markers(axes: Axes, markers: tuple[str, ...], places: np.ndarray, half_width: float) -> None:
    """Draw rings with slanted names; markers off the middle are named next to their ring."""
    low, high = 0.42 * half_width, 0.56 * half_width
    on_middle = np.abs(places[:, 1]) < 1.0
    named_at = places[:, 0].copy()
    named_at[on_middle] = _move_apart(places[on_middle, 0])
    for name, (x, y, _), at, middle in zip(markers, places, named_at, on_middle, strict=True):
        axes.plot(x, y, "o", color=INK, markerfacecolor=SURFACE, markersize=5.5, markeredgewidth=1.4, zorder=4)
        if middle:
            axes.plot([x, x, at], [0, low, high], color=FAINT, linewidth=0.7, zorder=1)
        below = not middle and y < 0  # where no tendon runs through its name
        height = high + 0.02 * half_width if middle else y + (-6 if below else 6)
        turn, side = (-45, "top") if below else (45, "bottom")
        axes.text(at, height, name.replace("_", " "), rotation=turn, fontsize=9, ha="left", va=side, zorder=5)


def _move_apart(x: np.ndarray) -> np.ndarray:
    """Place (k,) slanted names so that they do not overlap, as near as possible to where they belong, mm."""
    order, at = np.argsort(x), np.sort(x)
    for _ in range(_ROUNDS):
        short = np.maximum(_NAMES_APART_MM - np.diff(at), 0.0) / 2
        at[:-1] -= short
        at[1:] += short
    placed = np.empty_like(at)
    placed[order] = at
    return placed


def _draw_scale(axes: Axes, left: float, right: float, half_width: float) -> None:
    base = -0.82 * half_width
    axes.plot([right - 120, right - 20], [base, base], color=MUTED, linewidth=1.5, solid_capstyle="butt")
    axes.text(right - 70, base + 4, "100 mm", ha="center", va="bottom", fontsize=8, color=MUTED)
    arrow = {"arrowstyle": "-|>", "color": MUTED, "linewidth": 1.0}
    axes.annotate("", (left + 8, base), (left + 70, base), arrowprops=arrow)
    axes.text(left + 74, base, "swims this way", va="center", fontsize=8, color=MUTED)


def build_robot(context: ReportContext) -> Section:
    """Build the section with a sketch of the robot to scale."""
    robot = context.calibration.robot
    drawn = Plot(
        robot_figure(robot, context.session.markers),
        "robot",
        f"The robot from above and from the side, to scale ({in_mm(robot.length_m, 0)} mm long): rings are the "
        "tracked markers, dots the hinges, the orange lines the tendons.",
    )
    return Section("Robot", "robot-sketch", (Plots((drawn,)),))


def build_structure(context: ReportContext) -> Section:
    """Build the section: a row for each number of the structure, then how the crank turns."""
    structure = context.calibration.structure
    rows = (*map(_row, structure.sources), *_turns(context))
    return Section(
        "What the twin is built from",
        "structure",
        (Table(_describe_sources(structure.sources), COLUMNS, rows),),
        tuple(sentence(flag.message) for flag in structure.flags if flag.kind == "not_used"),
    )


def _describe_sources(sources: tuple[Source, ...]) -> str:
    chain = "Free decays give the hinges, dry runs the crank arm, then the swims the fluid coefficients. "
    missing = [in_words(source.quantity) for source in sources if source.assumed]
    if not missing:
        return chain + "All numbers were measured in this session."
    return chain + (
        f"{sentence(listed(missing)).removesuffix('.')} {'was' if len(missing) == 1 else 'were'} not measured in this "
        "session. The fluid coefficients absorb errors of assumed values, as far as they can."
    )


def _row(source: Source) -> tuple[str, ...]:
    unit, scale = SHOWN_UNITS.get(source.unit, (source.unit, 1.0))
    value = scale * source.value
    shown = significant(value) if source.se is None else with_error(value, scale * source.se)
    origin = f"assumed; {source.sentence}" if source.assumed else listed(source.trials)
    return in_words(source.quantity), shown, unit, origin


def _turns(context: ReportContext) -> list[tuple[str, ...]]:
    """Make rows on how the crank turns: as the motor's log has it, evenly elsewhere."""
    logged, even = [trial.name for trial in context.logged if trial.motor.usable], context.even
    rows: list[tuple[str, ...]] = []
    if logged:
        rows.append(("crank angle", "as logged", "", f"motor log of {listed(logged)}"))
    if even:
        rows.append(("crank angle", "even", "", f"assumed: turns evenly at the tail’s own beat in {listed(even)}"))
    return rows


# The motor.


@styled
def motor_speed_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """Draw the log's speed and the command over time, a panel a trial, all to one scale."""
    columns, margins = min(len(trials), 2), Margins(top=0.5, right=0.14)
    figure, drawn = panels(len(trials), Grid(columns, 1.25, gap_in=(0.3, 0.5)), FULL_WIDTH_IN, margins)
    limits = _limits(trials)
    name_panels(drawn, [shortened(trial.name, 24) for trial in trials], columns, "time (s)", "crank (turns/s)")
    for trial, axes in zip(trials, drawn, strict=True):
        _draw_speed(axes, trial)
        axes.set_ylim(*limits)
        axes.tick_params(labelbottom=True)
        hz = trial.motor.commanded_hz
        result = f"{shown(trial.motor.measured_hz, 3)}{f' of {shown(hz, 3)}' if hz > 0 else ''} turns/s"
        axes.set_title(result, loc="right", pad=3)
    legend_on_top(figure, 4)
    return figure


def _limits(trials: Sequence[LoggedTrial]) -> tuple[float, float]:
    """Choose the range of the axis of speeds that all panels share, with room for the bar on top."""
    speeds = np.concatenate([np.concatenate([trial.speed[1], _extend_command(trial)[1]]) for trial in trials])
    known = speeds[np.isfinite(speeds)]
    slowest, fastest = float(known.min(initial=0.0)), float(known.max(initial=0.1))
    room = 0.12 * (fastest - slowest)
    return slowest - room, fastest + 1.6 * room


def _draw_speed(axes: Axes, trial: LoggedTrial) -> None:
    time_s, speed = trial.speed
    commanded_s, commanded = _extend_command(trial)
    stepped: Look = {"drawstyle": "steps-post", "solid_joinstyle": "miter", "linewidth": 2.4, "alpha": 0.8}
    axes.plot(time_s - trial.zero_s, speed, color=INK, linewidth=0.9, label="measured by the motor", zorder=2.1)
    axes.plot(commanded_s - trial.zero_s, commanded, color=EBT, label="commanded", **stepped)
    drive_s, on_top = np.array(trial.motor.drive_s) - trial.zero_s, axes.get_xaxis_transform()
    axes.plot(drive_s, [0.985, 0.985], color=MUTED, linewidth=2.5, transform=on_top, label="steady stretch")
    for start, end in np.array(trial.codes).reshape(-1, 2) - trial.zero_s:
        axes.axvspan(start, end, facecolor=SHADE, linewidth=0, label="code")
    axes.set_xlim(time_s[0] - trial.zero_s, time_s[-1] - trial.zero_s)


def _extend_command(trial: LoggedTrial) -> tuple[np.ndarray, np.ndarray]:
    """Return the command, its last speed held to the end of the log.

    Without one, the mean command of the steady stretch.
    """
    command = trial.command
    if command is None:
        return np.array(trial.motor.drive_s), np.full(2, trial.motor.commanded_hz)
    end_s = max(trial.speed[0][-1], command[0][-1])
    return np.append(command[0], end_s), np.append(command[1], command[1][-1])


@styled
def motor_turn_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """Draw the deviation from the mean speed over the shaft's angle, every turn and their mean, a panel a trial."""
    width, columns = _turn_layout(len(trials))
    rows, gap = -(-len(trials) // columns), 0.42
    height = _ROW_IN if rows > 2 else (_TALL_IN - gap * (rows - 1)) / rows
    figure, drawn = panels(len(trials), Grid(columns, height, gap_in=(0.28, gap)), width, Margins(top=0.5, right=0.16))
    turns = [100 * (trial.turns - 1) for trial in trials]
    reach = 1.1 * max([_LEAST_REACH, *(float(np.abs(percent).max()) for percent in turns if len(percent))])
    for share, axes in zip(turns, drawn, strict=True):
        _draw_turns(axes, share)
        axes.set_ylim(-reach, reach)
    names = [shortened(trial.name) for trial in trials]
    name_panels(drawn, names, columns, "angle of the shaft", "off its mean (%)")
    legend_on_top(figure, 2)
    return figure


def _turn_layout(count: int) -> tuple[float, int]:
    """Choose width and columns: those of all small multiples, but one or two panels fill the width, and four do not."""
    if count < 3:
        return FULL_WIDTH_IN, max(count, 1)
    return (HALF_WIDTH_IN, 2) if count == 4 else small_multiples(count)


def _draw_turns(axes: Axes, percent: np.ndarray) -> None:
    """Draw turns (t, BINS) as thin lines, closed to a whole turn, and their mean."""
    angle_deg = 360 * np.arange(BINS + 1) / BINS
    closed = np.concatenate([percent, percent[:, :1]], axis=1)
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    for turn in closed[-_MOST_TURNS:]:
        axes.plot(angle_deg, turn, color=MUTED, linewidth=0.5, alpha=0.5, label="a turn")
    if len(closed):
        axes.plot(angle_deg, closed.mean(axis=0), color=INK, linewidth=1.6, label="mean of the turns")
    axes.set_xlim(0, 360)
    axes.set_xticks([0, 180, 360], ["0°", "180°", "360°"])


def build_motor(context: ReportContext) -> Section | None:
    """Build the section; None where no trial has a log."""
    return motor_section(context.logged) if context.logged else None


def motor_section(trials: tuple[LoggedTrial, ...]) -> Section:
    """Build the section from logged trials: two tables, and their speeds drawn."""
    turning = Table(
        "Speed over the steady stretch, and the clock of the log against the video’s, ± standard error.",
        TURNING,
        tuple(map(_turning_row, trials)),
        folded=True,
    )
    caption = "What the motor drew, and what it reported."
    supply = Table(caption, SUPPLY, tuple(map(_supply_row, trials)), folded=True)
    return Section(
        "Motor",
        "motor",
        (Prose(_describe_trials(trials)), turning, Plots(_plots(trials)), supply),
        tuple(sentence(f"{trial.name}: {flag.message}") for trial in trials for flag in trial.motor.flags),
    )


def _describe_trials(trials: tuple[LoggedTrial, ...]) -> str:
    ripple = max(trial.motor.ripple for trial in trials)
    off = max(((abs(t.off_command), t.name) for t in trials if t.motor.commanded_hz > 0), default=None)
    command = "" if off is None else f" The mean speed is off the command by up to {percent(off[0])} ({off[1]})."
    return (
        f"The motor was logged in {counted(len(trials), 'trial')}{_say_followed(trials)}. Within a turn its speed "
        f"swings by ±{percent(ripple)} (√2 times its standard deviation).{command}"
    )


def _say_followed(trials: tuple[LoggedTrial, ...]) -> str:
    unused = [trial.name for trial in trials if not trial.motor.usable]
    if len(unused) == len(trials):
        return ", but no log could be used: every crank is taken to turn evenly"
    but = f", but not in {listed(unused)}, where the log is not used: see below" if unused else ""
    return f", and the twin’s crank follows the measured angle instead of an even turn{but}"


def _turning_row(trial: LoggedTrial) -> tuple[str, ...]:
    motor, clock = trial.motor, trial.motor.clock
    return (
        trial.name,
        "dry run" if trial.kind == "dry" else "swim",
        shown(motor.commanded_hz, 4),
        shown(motor.measured_hz, 4),
        shown(100 * trial.off_command, 2, signed=True),
        shown(100 * motor.ripple, 2),
        with_error(clock.offset_s, clock.offset_se_s, 3) if motor.laid else MISSING,
        with_error(MILLION * (clock.rate - 1), MILLION * clock.rate_se, 0) if motor.laid else MISSING,
        clock.found_by if motor.usable else f"{clock.found_by}, not used",
    )


def _supply_row(trial: LoggedTrial) -> tuple[str, ...]:
    log, steady = trial.motor.log, trial.steady
    current, voltage = np.abs(log.current_a[steady]), log.voltage_v[steady]
    warmth = log.temperature_c[np.isfinite(log.temperature_c)]
    errors = np.unique(log.error[np.isfinite(log.error) & (log.error != 0)])
    return (
        trial.name,
        shown(float(1 / np.median(np.diff(log.time_s))), 0),
        shown(_summarise(np.nanmean, current), 2),
        shown(_summarise(np.nanmax, current), 2),
        shown(_summarise(np.nanmean, voltage), 1),
        shown(_summarise(np.nanmin, voltage), 1),
        f"{warmth[0]:.0f} to {warmth[-1]:.0f}" if len(warmth) else MISSING,
        ", ".join(f"0x{int(error):02x}" for error in errors) or "none",
    )


def _summarise(summary: Callable[[np.ndarray], float], values: np.ndarray) -> float:
    """Apply a summary to the values that are there; nan where none is."""
    return float(summary(values)) if np.isfinite(values).any() else float("nan")


def _plots(trials: tuple[LoggedTrial, ...]) -> tuple[Plot, ...]:
    apart = listed([trial.name for trial in trials if not trial.motor.laid])
    own = f". {apart} could not be laid on the video: time from the beginning of the log" if apart else ""
    speeds = Plot(
        motor_speed_figure(trials),
        "motor-speed",
        "Speed of the crank over each trial and its command. Grey ground: coded wiggles; the bar on top: the steady "
        f"stretch{own}.",
    )
    turns = Plot(
        motor_turn_figure(trials),
        "motor-turn",
        "Speed through a turn of the shaft, about its mean. Grey: each turn; heavy: their mean. A pattern that all "
        "trials share belongs to the mechanism, one that grows with the speed to the load.",
    )
    return speeds, turns
