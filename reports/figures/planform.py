"""The figure of the robot from above, to scale."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Rectangle

from reports.colours import EBT, FAINT, INK, MUTED, SHADE, SURFACE, TWIN
from reports.numbers import MM
from reports.style import FULL_WIDTH_IN, Margins, panel, styled
from swimmer import RobotSpec

_NAMES_APART_MM = 27.0
_ROUNDS = 50  # iterations that move the names apart
_MARGINS = Margins(left=0.15, right=0.15, bottom=0.05, top=0.05)


@styled
def planform_figure(robot: RobotSpec, markers: tuple[str, ...]) -> Figure:
    """Draw head parts, crank, segments, tendons and fin as described; the markers in use are named."""
    places = robot.marker_positions_m(markers) * MM  # (m, 3)
    half_width = max(100.0, float(places[:, 1].max()) + 75, robot.crank.anchor_offset_m * MM + 30)
    nose = robot.markers["nose"].position_m[0] * MM
    left, right = nose - 45, nose + robot.length_m * MM + 75
    width = FULL_WIDTH_IN - _MARGINS.left - _MARGINS.right
    height = width * 2 * half_width / (right - left) + _MARGINS.bottom + _MARGINS.top
    figure, axes = panel(FULL_WIDTH_IN, height, _MARGINS)
    axes.set(xlim=(left, right), ylim=(-half_width, half_width))
    axes.set_axis_off()
    draw_head(axes, robot)
    draw_tail(axes, robot)
    _draw_tendons(axes, robot)
    _draw_markers(axes, markers, places, half_width)
    _draw_scale(axes, left, right, half_width)
    return figure


def draw_head(axes: Axes, robot: RobotSpec, face: str = SHADE) -> None:
    """Draw the water that the head pushes away as an ellipse, and its massive parts, mm."""
    x, y, _ = np.array(robot.head.fluid_centre_m) * MM
    a, b, _ = np.array(robot.head.fluid_half_size_m) * MM
    axes.add_patch(Ellipse((x, y), 2 * a, 2 * b, facecolor=face, edgecolor=MUTED, linewidth=0.8))
    for part in robot.head.part:
        (x, y, _), (a, b, _) = np.array(part.centre_m) * MM, np.array(part.half_size_m) * MM
        rectangle = Rectangle((x - a, y - b), 2 * a, 2 * b, facecolor=face, edgecolor=MUTED, linewidth=0.7)
        rectangle.set_alpha(0.75)
        axes.add_patch(rectangle)


def draw_tail(axes: Axes, robot: RobotSpec, face: str = SHADE, fin: str = TWIN) -> None:
    """Draw backbone, hinges, segments and, in a colour of its own, the fin, mm."""
    start, end = robot.tail.start_m * MM, robot.fin_root_x_m * MM
    axes.plot([start, end], [0, 0], color=MUTED, linewidth=1.0)
    for (front, rear), segment in zip(robot.segment_x_m * MM, robot.tail.segment, strict=True):
        reach = max(segment.guide_offset_m, segment.thickness_m) * MM + 3
        rib = Rectangle((front, -reach), rear - front, 2 * reach, facecolor=face, edgecolor=MUTED, linewidth=0.7)
        axes.add_patch(rib)
    axes.plot(robot.hinge_x_m * MM, np.zeros(len(robot.hinge_x_m)), "o", color=MUTED, markersize=3.5, zorder=3)
    tip = end + (robot.caudal_fin.centre_m + robot.caudal_fin.chord_m / 2) * MM
    axes.plot([end, tip], [0, 0], color=fin, linewidth=3.0, solid_capstyle="butt")


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
        height = high + 0.02 * half_width if middle else y + 6
        axes.text(at, height, name.replace("_", " "), rotation=45, fontsize=9, ha="left", va="bottom", zorder=5)


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
