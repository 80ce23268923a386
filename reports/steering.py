"""Section on steering with a policy: which targets are reached, and how closely circles are followed."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Wedge
from scipy.stats import binomtest

from reports.context import PolicySwims, ReportContext
from reports.page import Plot, Plots, Prose, Section, Table, table_head
from reports.style import (
    EBT,
    FAINT,
    FULL_WIDTH_IN,
    GAP,
    HALF_WIDTH_IN,
    INK,
    MUTED,
    SURFACE,
    TWIN,
    Margins,
    add_panel,
    legend_above,
    panel,
    styled,
)
from reports.words import MM, counted, percent, shown, spanned

# Figures
RINGS_M = (0.0, 0.75, 1.5, 2.25, 3.0, 4.5)  # edges of the cells by distance
SIDES_RAD = tuple(np.radians((0.0, 30.0, 60.0, 90.0)))  # edges of the cells by angle, to either side
_HEIGHT_IN = 3.5
_EDGE_M = 0.12  # margin about targets and start
_LEAST = 3  # a cell with fewer targets has no numbers
_MARGINS = Margins(left=0.52, right=0.08, bottom=0.42, top=0.36)

# Words and the table
METHODS = {"search": "A steering law of a few numbers, searched", "sac": "A network, trained with soft actor-critic"}
CIRCLE = table_head("circle | lap [s] | mean distance [mm] | largest [mm]")
ON_THE_TWIN = (
    "These swims are the twin’s own, on which the policy was made. On the robot it does no better than the twin is "
    "right; docs/policies.md has what was measured of that on a second simulator."
)


@styled
def paths_figure(swims: PolicySwims) -> Figure:
    """Draw the paths to targets from above, all from the origin, with rings where targets are reached."""
    figure, axes = panel(HALF_WIDTH_IN, _HEIGHT_IN, _MARGINS)
    shown_at = swims.path_m.shape[1]
    for path, reached in zip(np.swapaxes(swims.path_m, 0, 1), swims.reached, strict=False):
        axes.plot(*path.T, color=TWIN if reached else GAP, linewidth=0.8, alpha=0.7, zorder=2)
    reached, targets = swims.reached[:shown_at], swims.start_m[:shown_at]
    axes.plot(*targets[reached].T, "o", color=TWIN, markerfacecolor=SURFACE, markersize=4.5, zorder=3, label="reached")
    _draw_missed(axes, targets[~reached])
    _draw_start(axes)
    _scale_equally(axes, swims.start_m)
    legend_above(axes, 3)
    return figure


@styled
def reach_figure(swims: PolicySwims) -> Figure:
    """Draw cells by distance and bearing, coloured by the share reached, with the median time."""
    figure, axes = panel(HALF_WIDTH_IN, _HEIGHT_IN, _MARGINS)
    for inner, outer in pairwise(RINGS_M):
        for low, high in pairwise((*(-side for side in SIDES_RAD[:0:-1]), *SIDES_RAD)):  # sides run from right to left
            _draw_cell(axes, swims, (inner, outer), (low, high))
    _draw_missed(axes, swims.start_m[~swims.reached])
    _draw_start(axes)
    _scale_equally(axes, swims.start_m)
    axes.grid(visible=False)
    legend_above(axes, 1)
    return figure


def _draw_cell(axes: Axes, swims: PolicySwims, ring: tuple[float, float], side: tuple[float, float]) -> None:
    bearing = np.arctan2(-swims.start_m[:, 1], -swims.start_m[:, 0])
    within = (swims.distance_m >= ring[0]) & (swims.distance_m < ring[1]) & (bearing >= side[0]) & (bearing < side[1])
    if not within.any():
        return
    share = float(swims.reached[within].mean())
    theta = sorted(180 + np.degrees(side))  # a bearing to the left is towards -y, and ahead is -x
    wedge = Wedge((0, 0), ring[1], *theta, width=ring[1] - ring[0], linewidth=0)
    wedge.set(facecolor=TWIN if share >= 0.5 else GAP, alpha=0.05 + 0.4 * abs(2 * share - 1))
    axes.add_patch(wedge)
    axes.add_patch(Wedge((0, 0), ring[1], *theta, width=ring[1] - ring[0], fill=False, edgecolor=SURFACE, linewidth=1))
    if within.sum() < _LEAST or ring[0] == 0.0:
        return
    seconds = float(np.median(swims.seconds[within & swims.reached])) if share else np.nan
    text = f"{np.floor(100 * share):.0f} %\n{shown(seconds, 0)} s"
    x, y = swims.start_m[within].mean(axis=0)
    axes.text(x, y, text, ha="center", va="center", fontsize=6.5, color=INK)


def _draw_missed(axes: Axes, targets_m: np.ndarray) -> None:
    if len(targets_m):
        axes.plot(*targets_m.T, "X", color=GAP, markersize=5, markeredgewidth=0, zorder=3, label="missed")


def _draw_start(axes: Axes) -> None:
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.2}
    axes.annotate("", (-0.2, 0.0), (0.06, 0.0), arrowprops=arrow, zorder=4)


def _scale_equally(axes: Axes, targets_m: np.ndarray) -> None:
    """Give both axes equal scales, about all targets and the start."""
    seen = np.vstack([targets_m, np.zeros(2)])
    low, high = seen.min(axis=0) - _EDGE_M, seen.max(axis=0) + _EDGE_M
    box = axes.get_window_extent()
    half_m = float(np.max((high - low) / (box.width, box.height))) / 2 * np.array([box.width, box.height])
    middle = (low + high) / 2
    axes.set(xlim=middle[0] + half_m[0] * np.array([-1, 1]), ylim=middle[1] + half_m[1] * np.array([-1, 1]))
    axes.set(xlabel="x (m), ahead is −x", ylabel="y (m), left is −y")


@styled
def circle_figure(swims: PolicySwims) -> Figure:
    """Draw the circles from above, and the distance from them along the lap."""
    figure = Figure(figsize=(FULL_WIDTH_IN, 3.1))
    above = add_panel(figure, (0.55, 0.42), (2.35, 2.35))
    along = add_panel(figure, (3.75, 0.42), (4.85, 2.25))
    lap = np.linspace(0.0, 2 * np.pi, 200)
    above.set_aspect("equal", adjustable="datalim")
    for number, (path, start) in enumerate(zip(np.swapaxes(swims.path_m, 0, 1), swims.start_m, strict=False)):
        side, colour = -np.sign(start[1]), (TWIN, EBT)[number % 2]  # the left is towards -y
        middle = np.array([0.0, -side * swims.radius_m])
        above.plot(*(middle[:, None] + swims.radius_m * np.array([np.sin(lap), np.cos(lap)])), color=FAINT, linewidth=3)
        above.plot(*path.T, color=colour, linewidth=0.9)
        off = path[~np.isnan(path).any(axis=1)] - middle
        angle = np.unwrap(np.arctan2(-off[:, 0], side * off[:, 1]))
        outwards = (np.hypot(*off.T) - swims.radius_m) * MM
        label = "to the left" if side > 0 else "to the right"
        along.plot(np.degrees(angle), outwards, color=colour, linewidth=0.9, label=label)
    along.axhline(0.0, color=MUTED, linewidth=0.8)
    above.set(xlabel="x (m)", ylabel="y (m)")
    along.set(xlabel="along the circle (degrees)", ylabel="off the circle, outwards (mm)", xlim=(0, 360))
    along.set_xticks(range(0, 361, 60))
    legend_above(along, 2)
    return figure


def build_steering(context: ReportContext) -> Section | None:
    """Build the section; None where no policy was trained."""
    if not context.policies:
        return None
    caveats = [ON_THE_TWIN]
    for swims in context.policies:
        if not swims.of_this_fit:
            caveats.append(f"The policy for {swims.task} is of another fit than this report; train it again.")
        if swims.diverged.any():
            caveats.append(f"{swims.task}: {counted(int(swims.diverged.sum()), 'simulation')} diverged.")
    blocks = [block for swims in context.policies for block in (_targets if swims.task == "target" else _circle)(swims)]
    return Section("Steering", "steering", tuple(blocks), tuple(caveats))


def _describe_training(swims: PolicySwims) -> str:
    minutes = f"{shown(swims.trained_s / 60, 1 if swims.trained_s < 600 else 0)} min"
    return f"{METHODS.get(swims.method, swims.method)} for {minutes} on this twin (seed {swims.seed})"


def _targets(swims: PolicySwims) -> tuple[Prose | Plots | Table, ...]:
    hits, count = int(swims.reached.sum()), len(swims.reached)
    low, high = binomtest(hits, count).proportion_ci(0.95, method="wilson")  # Wilson (1927)
    median_s = float(np.median(swims.seconds[swims.reached])) if hits else None
    text = (
        f"{_describe_training(swims)}, reaches {hits} of {count} random targets ({spanned(low, high, percent)}, 95 % "
        f"interval), in the median after {shown(median_s)} s."
    )
    paths = Plot(
        paths_figure(swims),
        "steering-paths",
        f"The first {swims.path_m.shape[1]} ways to a target, from above. It begins at rest, where the arrow is. "
        "A way ends within reach of its target, or when its time is over.",
    )
    reach = Plot(
        reach_figure(swims),
        "steering-reach",
        "Targets by distance and angle: the share reached, and the median time that it took. A near target to the "
        "side is within the turning circle, so the robot turns away first. Without numbers: too near, or too few.",
    )
    return (Prose(text), Plots((paths, reach)))


def _circle(swims: PolicySwims) -> tuple[Prose | Plots | Table, ...]:
    mean, largest = swims.off_path_m * MM
    rows = []
    for number, start in enumerate(swims.start_m):
        lap = shown(float(swims.seconds[number])) if swims.reached[number] else "not finished"
        side = "to the left" if start[1] < 0 else "to the right"
        rows.append((side, lap, shown(float(mean[number])), shown(float(largest[number]))))
    text = (
        f"{_describe_training(swims)}, follows a circle of {swims.radius_m:g} m at {shown(float(mean.mean()))} mm from "
        f"it in the mean and {shown(float(largest.max()))} mm at most. These are the two episodes that it was searched "
        "on."
    )
    figure = Plot(
        circle_figure(swims),
        "steering-circle",
        "The circle to either side, from rest. Left: from above, the circle in grey. Right: the distance from it along "
        "the lap; the fast ripple is the head that swings with every beat.",
    )
    return (Prose(text), Plots((figure,)), Table("The circle to either side.", CIRCLE, tuple(rows)))
