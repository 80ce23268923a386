"""The fish with its gap painted on it."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon

from diagnosis.result import DiagnosisResult
from reports.colours import FAINT, GAP, INK, MUTED, SURFACE, TWIN
from reports.figures.planform import draw_head, draw_tail
from reports.numbers import MM, whole_percent
from reports.style import FULL_WIDTH_IN, Margins, panel, styled
from swimmer import RobotSpec

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
