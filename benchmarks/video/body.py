"""Body of the robot as the camera sees it: boxes on its links, above and below the water."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from benchmarks.video.camera import Optics
from benchmarks.video.motion import WATER_LINE_M, Pose, RobotPoints
from benchmarks.video.picture import Colour, Picture, colour_of
from swimcal.robot import Marker, RobotSpec

_SKIN_M = 0.006  # thickness of the flexible cover on either side of a tail segment
_DRY_M = 0.004  # The tail's tops are this much above the water.
_CLEAR = ("plate", "fin")  # These parts are of acrylic, which lets the water shine through.


class Solid(NamedTuple):
    """A box fixed to a link; `low_m` and `high_m` are its corners on the straight robot (robot frame)."""

    link: str
    low_m: np.ndarray
    high_m: np.ndarray
    colour: Colour
    opacity: float


class Body:
    """Painter of a robot, without its markers.

    Args:
        robot: robot to paint.
        tint: colour that the water adds to what is under it.
        tone: gray of the body, 0 (black) to 255.
    """

    def __init__(self, robot: RobotSpec, tint: Colour, tone: float) -> None:
        self._tint = tint
        self._solids = sorted(solids_of(robot, tone), key=lambda solid: solid.high_m[2])
        self._points = RobotPoints(robot, [corner for solid in self._solids for corner in _list_corners(solid)])

    def paint(self, picture: Picture, camera: Optics, pose: Pose) -> None:
        """Paint the body at the s moments of an exposure, (s, ...) poses: the deepest tops first."""
        corner_m = self._points(pose)  # (s, 12 solids, 3)
        seen_px = camera.project(corner_m).reshape(len(corner_m), len(self._solids), 3, 4, 2)
        for number, solid in enumerate(self._solids):
            bottom, water, top = np.moveaxis(seen_px[:, number], 1, 0)  # each (s, 4, 2)
            if solid.low_m[2] < WATER_LINE_M:
                picture.paint_polygons(np.hstack([bottom, water]), _mix(solid.colour, self._tint, 0.45), 0.75)
            if solid.high_m[2] > WATER_LINE_M:
                picture.paint_polygons(np.hstack([water, top]), _darken(solid.colour), solid.opacity)
                picture.paint_polygons(top, solid.colour, solid.opacity)

    def outline_px(self, camera: Optics, pose: Pose) -> np.ndarray:
        """Return (solids, 12, 2) px of the corners of all boxes in one pose."""
        return camera.project(self._points(pose)).reshape(len(self._solids), 12, 2)


def solids_of(robot: RobotSpec, tone: float) -> Iterator[Solid]:
    """Yield the boxes of a robot: the head's parts, the tail's segments with half the gaps about them, the fin."""
    for part in robot.head.part:
        centre, half = np.array(part.centre_m), np.array(part.half_size_m)
        clear = any(word in part.name for word in _CLEAR)
        shade = tone * (1.4 if clear else 1.0)
        yield Solid("head", centre - half, centre + half, _make_gray(shade), 0.7 if clear else 1.0)
    x = robot.tail.start_m
    for link, segment in zip(robot.hinges, robot.tail.segment, strict=True):
        hinge, end = x + segment.gap_m / 2, x + segment.gap_m + segment.length_m
        yield _build_upright(link, hinge, end + segment.gap_m / 2, segment.half_height_m, segment.thickness_m, tone)
        x = end
    fin = robot.caudal_fin
    root = x + fin.gap_m
    yield _build_upright(robot.links[-1], x, root + fin.length_m, 0.02, fin.thickness_m, tone)
    start, end = root + fin.centre_m - fin.chord_m / 2, root + fin.centre_m + fin.chord_m / 2
    yield _build_upright(robot.links[-1], start, end, fin.span_m / 2, fin.thickness_m, tone * 1.3)


def _build_upright(
    link: str, start_m: float, end_m: float, half_height_m: float, thickness_m: float, tone: float
) -> Solid:
    side = thickness_m / 2 + _SKIN_M
    return Solid(
        link,
        np.array([start_m, -side, -half_height_m]),
        np.array([end_m, side, max(half_height_m, WATER_LINE_M + _DRY_M)]),
        _make_gray(tone),
        1.0,
    )


def _list_corners(solid: Solid) -> Iterator[Marker]:
    """Yield the corners of a box at its bottom, at the water and at its top: twelve."""
    low, high = solid.low_m, solid.high_m
    water = float(np.clip(WATER_LINE_M, low[2], high[2]))
    for z, (x, y) in product((low[2], water, high[2]), product((low[0], high[0]), (low[1], high[1]))):
        yield Marker(body=solid.link, position_m=(float(x), float(y), float(z)))


def _make_gray(tone: float) -> Colour:
    tone = min(tone, 255.0)
    return colour_of(tone, tone, tone * 1.04)


def _darken(colour: Colour) -> Colour:
    return Colour(16 + 0.75 * (colour.luma - 16), colour.blue, colour.red)


def _mix(one: Colour, other: Colour, share: float) -> Colour:
    return Colour(*(a + share * (b - a) for a, b in zip(one, other, strict=True)))
