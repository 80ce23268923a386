"""Figures of the sim-to-real gap: where it lies, which effect causes it, how far it shrinks.

`likenesses` finds the motion of the twin that a missing force goes with, for the words beside the figures.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyBboxPatch, Patch, Polygon

from diagnosis.constants import HELD
from diagnosis.places import HEAD
from diagnosis.result import DiagnosisResult, GapSize, MissingForces
from fitting.calibration import CalibratedTrial
from reports.robot import draw_head, draw_tail
from reports.style import (
    EBT,
    EBT_LARGE,
    EBT_SMOOTHED,
    FAINT,
    FULL_WIDTH_IN,
    GAP,
    HALF_WIDTH_IN,
    INK,
    INKS,
    MUTED,
    SURFACE,
    TWIN,
    WARN,
    Grid,
    Margins,
    add_panel,
    legend_on_top,
    name_panels,
    panel,
    panels,
    styled,
)
from reports.words import MM, in_words, shortened, shown, whole_percent
from swimcal.robot import RobotSpec

# What a missing force goes with
FORCES = HEAD[:2]  # forces in N; all others are torques in N m
LEAST_LIKE = 0.7  # smallest correlation with which a force goes with a motion
# A force is correlated with motions if it differs from zero in at least this share of the beat.
LEAST_CLEAR = 0.1
_LEAST_SHOWN = 5e-6  # smallest size, N or N m, that is not printed as 0.00 mN or mN m
_LEVEL = 0.03  # correlations that differ by less than this are level
_ON_MIDDLE_M = 0.005  # largest distance from the middle plane of a marker on the midline
_BESIDE_M = 0.02  # distance from the outer hinges to where the direction of their links is read

# The robot with the gap on it
_MARGINS = Margins(left=0.05, right=0.05, bottom=0.05, top=0.05)
_UP = 235.0  # height shown above the middle, mm
_DOWN = 225.0  # height shown below the middle, mm
_LARGEST = 21.0  # radius of the disc of a share of 1, mm
_FULLEST = 0.9  # opacity of a share of 1
_HALF_WIDTH = 62.0  # half width of the painted body, mm
_APART = 31.0  # distance between names of markers, mm
_STAGES = {
    "camera": ("camera", "the picture’s frame"),
    "body": ("body", "forces on the whole fish"),
    "drive": ("drive", "clock, motor, gearing"),
    "tail": ("tail", "hinges and tendons"),
    "floor": ("noise", "chance alone"),
}

# Missing forces over the beat
COLOURS = (TWIN, EBT, EBT_SMOOTHED, EBT_LARGE, WARN, GAP, *(INKS[n].light for n in ("flag-merged", "flag-frozen")))
MILLI = 1000.0  # mN in a newton
_FINEST = 1.0  # every panel reaches at least this far, mN or mN m
_ANGLES = np.linspace(0.0, 2 * np.pi, 73)  # angles of the crank that are drawn
_COLUMNS = 4  # panels in a row

# Shares of the gap
_ROW_IN = 0.2
_LEFT_IN = 0.62
_TOP_IN = 0.52
_BOTTOM_IN = 0.34
_LABEL_IN = 0.82
_GAP_IN = 0.3
_NAMES = {"floor": "noise"}

# Effects
_MOST = 9  # largest number of effects that are shown
_LEAST = 0.005  # smallest probability that is shown of an effect that is not named
_OTHERS = {"none_of_these": "none of these", "nothing": "nothing at all"}


# What a missing force goes with.


def force_name(joint: str) -> str:
    """Name the missing force of a joint, in words."""
    names = {HEAD[0]: "force along the head", HEAD[1]: "force across the head", HEAD[2]: "moment on the head"}
    return names.get(joint) or f"torque in {joint.replace('_', ' ')}"


def seen(forces: MissingForces) -> list[int]:
    """List the places of the joints whose missing force is not 0 as it would be printed."""
    return [place for place, size in enumerate(forces.size) if size >= _LEAST_SHOWN]


class Likeness(NamedTuple):
    """The motions that a missing force goes with: the likest and those level with it.

    The correlation with the first.
    """

    motions: tuple[str, ...]
    correlation: float


def likenesses(forces: MissingForces, trials: Sequence[CalibratedTrial], robot: RobotSpec) -> dict[str, Likeness]:
    """Find the motion of the twin that each force goes with, in all swims by one factor.

    The motions are deflection, speed, speed squared and acceleration; means are left out.

    Args:
        forces: the missing forces of the diagnosis.
        trials: the swims of the fit.
        robot: the robot as described.
    """
    of_name = {trial.measured.name: trial for trial in trials}
    known = [(i, of_name[name]) for i, name in enumerate(forces.trials) if name in of_name]
    found: dict[str, list[tuple[np.ndarray, dict[str, np.ndarray]]]] = {joint: [] for joint in forces.joints}
    for place, trial in known:
        kept = trial.measured.kept & np.isfinite(trial.simulated.shape_m).all(axis=(1, 2))
        time_s = trial.measured.time_s[kept]
        turn = trial.phase_rad + trial.measured.crank_rad(time_s, trial.simulated_hz)
        force, _ = forces.over(turn)
        for joint, motion in motions(trial, kept, robot).items():
            if joint in found:
                own = force[place, forces.joints.index(joint)]
                found[joint].append((_about_mean(own), _rates(motion, time_s)))
    return {joint: _likest(parts, joint in HEAD) for joint, parts in found.items() if parts}


def motions(trial: CalibratedTrial, kept: np.ndarray, robot: RobotSpec) -> dict[str, np.ndarray]:
    """Compute (n,) motions in the kept frames: the head along and across itself (m), its heading and the hinges (rad).

    A hinge bends by the angle that the line through the markers turns from the link before it to the one behind it.

    Args:
        trial: the swim.
        kept: (n,) mask of the frames that are used.
        robot: the robot as described.
    """
    head, place = trial.simulated, robot.marker_positions_m(trial.measured.markers)
    middle = [int(i) for i in np.argsort(place[:, 0]) if abs(place[i, 1]) < _ON_MIDDLE_M]
    steps = np.diff(head.shape_m[kept][:, middle], axis=1)  # (n, k, 2)
    turned = np.unwrap(np.arctan2(steps[..., 1], steps[..., 0]), axis=1)  # (n, k)
    between = (place[middle[:-1], 0] + place[middle[1:], 0]) / 2
    hinge = robot.hinge_x_m
    links = np.concatenate([[hinge[0] - _BESIDE_M], (hinge[:-1] + hinge[1:]) / 2, [hinge[-1] + _BESIDE_M]])
    hinges = np.diff([np.interp(links, between, row) for row in turned], axis=1)  # (n, h)
    moved = {"head_along": head.path_m[kept, 0], "head_across": head.path_m[kept, 1]}
    return moved | {"head_moment": head.heading_rad[kept]} | dict(zip(robot.hinges, hinges.T, strict=True))


def _rates(motion: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    speed = np.gradient(motion, time_s)
    series = {
        "deflection": motion,
        "speed": speed,
        "speed squared": speed * np.abs(speed),
        "acceleration": np.gradient(speed, time_s),
    }
    return {name: _about_mean(values) for name, values in series.items()}


def _about_mean(values: np.ndarray) -> np.ndarray:
    """Subtract the mean, after dropping the ends, where differences are one-sided: (n - 4,)."""
    inner = values[2:-2]
    return np.asarray(inner - inner.mean())


def _likest(parts: Sequence[tuple[np.ndarray, Mapping[str, np.ndarray]]], free: bool) -> Likeness:
    """Find the motion that correlates most.

    Of a body that rests on nothing (`free`), place and heading do not count.
    """
    force = np.concatenate([own for own, _ in parts])
    names = [name for name in parts[0][1] if not (free and name == "deflection")]
    columns = {name: np.concatenate([rates[name] for _, rates in parts]) for name in names}
    correlations = {
        name: float(motion @ force / max(np.linalg.norm(motion) * np.linalg.norm(force), 1e-300))
        for name, motion in columns.items()
    }
    best = max(correlations, key=lambda name: abs(correlations[name]))
    level = [name for name, r in correlations.items() if abs(r) > abs(correlations[best]) - _LEVEL]
    return Likeness(tuple(sorted(level, key=lambda name: -abs(correlations[name]))), correlations[best])


# The robot with the gap on it.


@styled
def gap_fish_figure(found: DiagnosisResult, robot: RobotSpec, markers: tuple[str, ...]) -> Figure:
    """Draw the robot, its parts in the colour of their stage's share, a disc on each marker as large as its share."""
    nose = robot.markers["nose"].position_m[0] * MM
    left, right = nose - 236, nose + robot.length_m * MM + 95
    width = FULL_WIDTH_IN - _MARGINS.left - _MARGINS.right
    height = width * (_UP + _DOWN) / (right - left) + _MARGINS.bottom + _MARGINS.top
    figure, axes = panel(FULL_WIDTH_IN, height, _MARGINS)
    axes.set(xlim=(left, right), ylim=(-_DOWN, _UP))
    axes.set_axis_off()
    stages = found.where.by_stage
    _paint_frame(axes, (left, right), stages["camera"])
    _paint_fish(axes, robot, stages)
    draw_head(axes, robot, "none")
    draw_tail(axes, robot, "none", MUTED)
    _name_stages(axes, robot, stages, (left, right))
    _draw_discs(axes, robot, markers, found.where.by_marker)
    return figure


def _paint(share: float) -> tuple[str, float]:
    """Return colour and opacity of a share; small shares are lifted so that they can be told from none."""
    return GAP, _FULLEST * max(float(np.clip(share, 0.0, 1.0)) ** 0.6, 0.04)


def _paint_frame(axes: Axes, ends: tuple[float, float], share: float) -> None:
    left, right = ends
    frame = FancyBboxPatch(
        (left + 14, -_DOWN + 14),
        right - left - 28,
        _UP + _DOWN - 28,
        boxstyle="round,pad=0,rounding_size=16",
        facecolor="none",
        edgecolor=_paint(share),
        linewidth=9,
    )
    axes.add_patch(frame)


def _paint_fish(axes: Axes, robot: RobotSpec, stages: Mapping[str, float]) -> None:
    """Draw a fish around the robot: its body, its tail that tapers to the fin, and the crank within."""
    nose, start, root = robot.markers["nose"].position_m[0] * MM, robot.tail.start_m * MM, robot.fin_root_x_m * MM
    tip = root + (robot.caudal_fin.centre_m + robot.caudal_fin.chord_m / 2) * MM
    bow = np.linspace(0.0, np.pi / 2, 40)
    waist, middle = 34.0, nose + 0.42 * (start - nose)
    front = np.column_stack([middle - (middle - nose + 14) * np.sin(bow), _HALF_WIDTH * np.cos(bow)])[::-1]
    along = np.linspace(0.0, 1.0, 40)
    rear = np.column_stack(
        [middle + (start - middle) * along, waist + (_HALF_WIDTH - waist) * np.cos(np.pi / 2 * along) ** 1.2]
    )
    tail = np.array([[start, waist], [root, 8.0], [tip, 34.0], [tip - 12, 0.0]])
    for outline, stage in ((np.vstack([front, rear]), "body"), (tail, "tail")):
        whole = np.vstack([outline, outline[::-1] * [1, -1]])
        axes.add_patch(Polygon(whole, closed=True, facecolor=_paint(stages[stage]), edgecolor=GAP, linewidth=0.6))
    x = robot.crank.position_m[0] * MM
    axes.add_patch(Circle((x, 0), 24, facecolor=SURFACE, edgecolor="none", zorder=2.4))
    axes.add_patch(Circle((x, 0), 24, facecolor=_paint(stages["drive"]), edgecolor=GAP, linewidth=0.8, zorder=2.5))


def _name_stages(axes: Axes, robot: RobotSpec, stages: Mapping[str, float], ends: tuple[float, float]) -> None:
    """Write share and name of each stage in a row below, with a line to its part."""
    left, right = ends
    columns = np.linspace(left + 92, right - 92, len(_STAGES))
    crank, start = robot.crank.position_m[0] * MM, robot.tail.start_m * MM
    head = robot.markers["nose"].position_m[0] * MM
    parts = {
        "body": (head + 0.4 * (crank - head), -50.0),
        "drive": (crank, -24.0),
        "tail": (start + 0.35 * (robot.length_m * MM - start), -22.0),
    }
    for x, (stage, (name, words)) in zip(columns, _STAGES.items(), strict=True):
        colour = MUTED if stage == "floor" else INK
        if stage in parts:
            part = parts[stage]
            axes.plot([part[0], x], [part[1], -112], color=MUTED, linewidth=0.8, zorder=3)
        axes.text(
            x, -118, whole_percent(stages[stage]), ha="center", va="top", fontsize=18, fontweight="bold", color=colour
        )
        axes.text(x, -156, name, ha="center", va="top", fontsize=9.5, fontweight="bold", color=colour)
        axes.text(x, -177, words, ha="center", va="top", fontsize=7.5, color=MUTED)


def _draw_discs(axes: Axes, robot: RobotSpec, markers: tuple[str, ...], shares: Mapping[str, float]) -> None:
    """Draw a disc for each marker and for each quantity of the whole fish.

    Those of the whole fish are in front of the nose; that of free decays is below the tail.
    """
    nose = robot.markers["nose"].position_m[0] * MM
    places = {
        name: (x * MM, y * MM) for name, (x, y, _) in zip(markers, robot.marker_positions_m(markers), strict=True)
    }
    places |= {"course": (nose - 164, 0.0), "speed": (nose - 118, 0.0), "frequency": (nose - 72, 0.0)}
    if "ringing" in shares:  # there are free decays
        places["ringing"] = (nose + robot.length_m * MM - 8, -74.0)
    arrow = {"arrowstyle": "-|>", "color": MUTED, "linewidth": 1.0}
    axes.annotate("", (nose - 208, 0), (nose - 30, 0), arrowprops=arrow, zorder=1)
    last = -np.inf
    for name, (x, y) in sorted(places.items(), key=lambda item: item[1]):
        share = shares.get(name, 0.0)
        radius = max(_LARGEST * np.sqrt(max(share, 0.0)), 3.0)
        axes.add_patch(Circle((x, y), radius, facecolor=TWIN, edgecolor=SURFACE, linewidth=0.9, zorder=4))
        text = f"{name.replace('_', ' ')} {whole_percent(share)}"
        weight = "bold" if share == max(shares.values()) else "normal"
        place = (x, y + radius + 3)
        if abs(y) < 1.0:
            last = max(x, last + _APART)
            place = (last, 112.0)
            axes.plot([x, x, last], [radius, 80.0, 108.0], color=FAINT, linewidth=0.7, zorder=1)
        axes.text(*place, text, rotation=45, fontsize=8.5, ha="left", va="bottom", zorder=5, fontweight=weight)


# Missing forces over the beat.


@styled
def gap_forces_figure(forces: MissingForces) -> Figure:
    """Draw a panel for each force or moment, a line for each swim with two standard deviations on either side."""
    mean, sd = forces.over(_ANGLES)
    grid = Grid(_COLUMNS, 1.1, (0.42, 0.42))
    figure, drawn = panels(len(forces.joints), grid, FULL_WIDTH_IN, Margins(left=0.55, top=0.52, bottom=0.42))
    for place, axes in enumerate(drawn):
        for trial, name in enumerate(forces.trials):
            _line(axes, mean[trial, place], sd[trial, place], COLOURS[trial % len(COLOURS)], shortened(name))
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        axes.set(xlim=(0, 360), xticks=[0, 90, 180, 270, 360])
        axes.locator_params(axis="y", nbins=5)
    names = [f"{force_name(joint)} ({'mN' if joint in FORCES else 'mN m'})" for joint in forces.joints]
    name_panels(drawn, names, _COLUMNS, "angle of the crank (°)")
    _level(drawn, forces.joints)
    legend_on_top(figure, min(len(forces.trials), 8))
    return figure


def _level(drawn: list[Axes], joints: tuple[str, ...]) -> None:
    """Give all hinges one scale, and no panel a scale so fine that nothing looks like something."""
    reach = {joint: max(map(abs, axes.get_ylim())) for axes, joint in zip(drawn, joints, strict=True)}
    hinges = max([reach[joint] for joint in joints if joint not in HEAD], default=0.0)
    for axes, joint in zip(drawn, joints, strict=True):
        end = max(reach[joint] if joint in HEAD else hinges, _FINEST)
        axes.set_ylim(-end, end)
        axes.tick_params(labelleft=True)


def _line(axes: Axes, mean: np.ndarray, sd: np.ndarray, colour: str, label: str) -> None:
    degrees = np.rad2deg(_ANGLES)
    axes.fill_between(degrees, MILLI * (mean - 2 * sd), MILLI * (mean + 2 * sd), color=colour, alpha=0.18, linewidth=0)
    axes.plot(degrees, MILLI * mean, color=colour, label=label)


# Held-out swims.


@styled
def gap_held_out_figure(gap: GapSize, added: bool) -> Figure:
    """Draw a row for each held-out swim, of which there is at least one, and one for the mean.

    Left are marker distances in mm, right speed errors in mm/s.
    """
    trials = gap.trials or {}
    names, compared = [*trials, "mean"], list(trials.values())
    before_mm, after_mm = np.array([[trial.before_mm, trial.after_mm] for trial in compared]).T
    errors = MM * np.abs([[t.speed_before - t.speed_measured, t.speed_after - t.speed_measured] for t in compared]).T
    grid = Grid(2, 0.2 + 0.24 * len(names), (0.22, 0.0))
    figure, (left, right) = panels(2, grid, HALF_WIDTH_IN, Margins(left=0.85, right=0.2, top=0.5, bottom=0.42))
    _rows(left, _with_mean(before_mm), _with_mean(after_mm), added)
    _rows(right, _with_mean(errors[0]), _with_mean(errors[1]), added)
    left.axvline(gap.noise_floor_mm, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), label="noise")
    left.set(xlabel="marker distance (mm)")
    right.set(xlabel="speed error (mm/s)")
    left.set_yticks([-row for row in range(len(names))], [shortened(name, 12) for name in names])
    left.get_yticklabels()[-1].set_fontweight("bold")
    right.set_yticks([])
    legend_on_top(figure, 2)
    return figure


def _with_mean(values: np.ndarray) -> np.ndarray:
    return np.append(values, np.mean(values))


def _rows(axes: Axes, before: np.ndarray, after: np.ndarray, changed: bool) -> None:
    reach = (1.75 if changed else 1.25) * max(float(before.max()), float(after.max()), 1e-9)
    for row, (start, end) in enumerate(zip(before, after, strict=True)):
        last = row == len(before) - 1
        axes.plot([0, reach], [-row, -row], color=FAINT, linewidth=0.6, zorder=0.5)
        colour = EBT_SMOOTHED if end <= start else WARN
        size = 6 if last else 4.5
        axes.plot(
            start, -row, "o", color=MUTED, markerfacecolor=SURFACE, markersize=size, label="plain twin", zorder=2.1
        )
        if changed:
            label = "with effects" if end <= start else "worse with them"
            axes.plot([start, end], [-row, -row], color=colour, linewidth=2.4 if last else 1.6)
            axes.plot(end, -row, "o", color=colour, markersize=size, label=label)
        axes.text(
            max(start, end) + 0.05 * reach,
            -row,
            f"{shown(start, 1)} → {shown(end, 1)}" if changed else shown(start, 1),
            va="center_baseline",
            fontsize=7,
            color=INK,
            fontweight="bold" if last else "normal",
        )
    axes.set(xlim=(0.0, reach), ylim=(-len(before) + 0.4, 0.6))
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.locator_params(axis="x", nbins=4)


# Shares of the gap.


@styled
def gap_shares_figure(found: DiagnosisResult) -> Figure:
    """Draw the shares in four panels, all from 0 to 100 %."""
    splits = {split: getattr(found.where, f"by_{split}") for split in ("stage", "trial", "band", "axis")}
    rows = max(len(shares) for shares in splits.values())
    height = _TOP_IN + rows * _ROW_IN + _BOTTOM_IN
    figure = Figure(figsize=(FULL_WIDTH_IN, height))
    width = (FULL_WIDTH_IN - _LEFT_IN - 3 * (_LABEL_IN + _GAP_IN) - 0.1) / 4.6
    left = _LEFT_IN
    for split, shares in splits.items():
        size = width * (1.6 if split == "stage" else 1.0), len(shares) * _ROW_IN
        axes = add_panel(figure, (left, height - _TOP_IN - size[1]), size)
        _bars(axes, shares, found.stage_alone if split == "stage" else {}, split)
        left += size[0] + _GAP_IN + _LABEL_IN
    handles = [
        Patch(facecolor=GAP, alpha=0.8, label="share, all stages together"),
        Line2D([], [], color=INK, linewidth=1.2, marker="|", markersize=7, label="if it were the only stage"),
        Patch(facecolor=MUTED, alpha=0.6, label="noise"),
    ]
    legend_on_top(figure, 3, handles)
    return figure


def _bars(axes: Axes, shares: Mapping[str, float], alone: Mapping[str, float], split: str) -> None:
    for row, (name, share) in enumerate(shares.items()):
        colour = MUTED if name == "floor" else GAP if split == "stage" else TWIN
        axes.barh(-row, 1.0, height=0.68, color=FAINT, alpha=0.35)
        axes.barh(-row, share, height=0.68, color=colour, alpha=0.6 if name == "floor" else 0.8)
        end = share
        if name in alone:
            end = max(share, alone[name])
            axes.plot([share, alone[name]], [-row, -row], color=INK, linewidth=1.2)
            axes.plot(alone[name], -row, "|", color=INK, markersize=7, markeredgewidth=1.3)
        text = whole_percent(share) if name not in alone else _range(share, alone[name])
        axes.text(max(end, 0.0) + 0.03, -row, text, va="center_baseline", fontsize=7, color=INK)
    axes.set(xlim=(min(0.0, *shares.values()), 1.32), ylim=(-len(shares) + 0.5, 0.5))
    axes.set_yticks(
        [-row for row in range(len(shares))],
        [shortened(name if split == "trial" else _NAMES.get(name, in_words(name)), 13) for name in shares],
    )
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100 %"])
    axes.set_title(f"by {split}", loc="left", pad=3, fontweight="bold")
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)


def _range(share: float, alone: float) -> str:
    """Format two shares as a range, `3 to 10 %`, or as one number where both are the same."""
    ends = [whole_percent(value) for value in sorted((share, alone))]
    return ends[0] if ends[0] == ends[1] else f"{ends[0][:-2]} to {ends[1]}"


# Effects.


@styled
def gap_effects_figure(found: DiagnosisResult) -> Figure:
    """Draw a bar for each effect, the likeliest first; those that are named in colour."""
    chances = found.chances
    others = {"none_of_these": found.none_of_these, "nothing": found.no_gap_probability}
    likeliest = [name for name in chances if chances[name] >= _LEAST or name in found.effects][:_MOST]
    rows = [*((name, chances[name]) for name in likeliest), *others.items()]
    figure, axes = panel(HALF_WIDTH_IN, 0.62 + 0.21 * len(rows), Margins(left=1.55, right=0.42, bottom=0.36, top=0.16))
    axes.axvline(HELD, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0.5)
    axes.text(HELD, 0.75, "named from here", ha="center", va="bottom", fontsize=7, color=MUTED)
    for row, (name, chance) in enumerate(rows):
        _bar(axes, -row - 0.4 * (name in others), name, chance, found)
    ticks = [-row - 0.4 * (name in others) for row, (name, _) in enumerate(rows)]
    axes.set_yticks(ticks, [_OTHERS.get(name, in_words(name)) for name, _ in rows])
    for label, (name, _) in zip(axes.get_yticklabels(), rows, strict=True):
        label.set_fontweight("bold" if name in found.effects else "normal")
    axes.set(xlim=(0.0, 1.0), ylim=(ticks[-1] - 0.6, 0.7), xlabel="probability that it is present")
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    return figure


def _bar(axes: Axes, row: float, name: str, chance: float, found: DiagnosisResult) -> None:
    named = name in found.effects
    colour = TWIN if named else GAP if name == "none_of_these" else MUTED
    axes.barh(row, 1.0, height=0.66, color=FAINT, alpha=0.3)
    axes.barh(row, chance, height=0.66, color=colour, alpha=1.0 if chance >= HELD or not named else 0.7)
    axes.text(1.02, row, shown(chance, 2), va="center_baseline", fontsize=7.5, color=INK if named else MUTED)
