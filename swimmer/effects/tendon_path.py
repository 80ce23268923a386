"""The way of the tendons from the crank through the guides: lengths, and how they change with crank and hinges."""

from typing import NamedTuple

import mujoco
import numpy as np

from swimmer.mjcf import SIDES
from swimmer.robot import RobotSpec


class Spans(NamedTuple):
    """The straight pieces of both tendons, one over each hinge, of n simulations.

    Attributes:
        length_m: (n, 2, h) left and right.
        per_hinge: (n, 2, h) by how much each grows with the angle of its own hinge, m/rad.
        per_crank: (n, 2) by how much the first one grows with the angle of the crank, m/rad.
    """

    length_m: np.ndarray
    per_hinge: np.ndarray
    per_crank: np.ndarray


class TendonPath:
    """Tendons of a robot as polygons from the anchor on the crank through one guide a segment.

    A piece runs between two neighbouring links, so its length depends on the one hinge between them; that of the first
    one on the crank too.

    Args:
        robot: the robot.
        radius_m: (n,) of the anchors about the shaft where n simulations differ in it; default the robot's.
    """

    def __init__(self, robot: RobotSpec, radius_m: np.ndarray | None = None) -> None:
        hinge_x, crank = robot.hinge_x_m, robot.crank
        guide_x = robot.segment_x_m[:, 1] - robot.tail.guide_inset_m
        inner = np.array([s.guide_offset_m * (-1 if s.tendon_crosses else 1) for s in robot.tail.segment])
        sign = np.array([sign for _, sign in SIDES])
        guide_y = sign[:, None] * inner  # (2, h)
        self._to = np.stack([np.broadcast_to(guide_x - hinge_x, guide_y.shape), guide_y], axis=-1)  # (2, h, 2)
        self._from = np.zeros((2, len(hinge_x), 3))  # relative to the hinge; of the first piece the shaft's
        self._from[:, 1:, 0], self._from[:, 1:, 1] = guide_x[:-1] - hinge_x[1:], guide_y[:, :-1]
        self._from[:, 0] = np.subtract(crank.position_m, [hinge_x[0], 0, 0])
        self._from[:, 0, 1] += sign * crank.anchor_offset_m
        self._arm = sign * (crank.anchor_radius_m if radius_m is None else radius_m[:, None])

    def __call__(self, crank_rad: np.ndarray, hinges_rad: np.ndarray) -> Spans:
        """Of crank angles (n,) and hinge angles (n, h)."""
        sin, cos = np.sin(crank_rad)[:, None] * self._arm, np.cos(crank_rad)[:, None] * self._arm  # (n, 2)
        c, s = np.cos(hinges_rad)[:, None], np.sin(hinges_rad)[:, None]
        x, y = self._to[..., 0], self._to[..., 1]
        end_x, end_y = c * x - s * y, s * x + c * y  # (n, 2, h)
        piece_x, piece_y, up = end_x - self._from[..., 0], end_y - self._from[..., 1], -self._from[0, 0, 2] - cos
        piece_x[:, :, 0] -= sin
        length = np.sqrt(piece_x**2 + piece_y**2)
        length[:, :, 0] = np.hypot(length[:, :, 0], up)
        per_hinge = (piece_y * end_x - piece_x * end_y) / length
        per_crank = (up * sin - piece_x[:, :, 0] * cos) / length[:, :, 0]
        return Spans(length, per_hinge, per_crank)

    def straight(self) -> Spans:
        """Of the straight tail at crank angle 0, where the tendons are cut to length."""
        return self(np.zeros(1), np.zeros((1, self._to.shape[1])))


def rest_lengths(spec: mujoco.MjSpec, robot: RobotSpec) -> np.ndarray:
    """(2, 2) from and to which length the left and the right tendon are at rest, m: as set, or of the straight tail.

    Left to the compiler they would follow the hinges' own rest angles.
    """
    set_m = np.array([spec.tendon(f"tendon_{side}").springlength for side, _ in SIDES])
    return np.where(set_m < 0, TendonPath(robot).straight().length_m[0].sum(axis=-1)[:, None], set_m)


def set_rest_lengths(spec: mujoco.MjSpec, length_m: np.ndarray) -> None:
    """Sets them, (2, 2) as above."""
    for (side, _), length in zip(SIDES, length_m, strict=True):
        spec.tendon(f"tendon_{side}").springlength = length
