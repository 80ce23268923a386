"""The robot's plates in the water, for forces that the engine does not know: planar motion and generalised forces.

Places, velocities and forces in the plane of the pool are complex numbers, x + i y; every plate is that of a fluid
geom of the model.
"""

from typing import NamedTuple

import numpy as np

from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

_HEAD_JOINTS = 3  # surge, sway, yaw: those of a head that is free


class Motion(NamedTuple):
    """Motion of the p plates of n simulations, in the pool.

    Attributes:
        place: (n, p) centres, m.
        velocity: (n, p) velocities of the centres, m/s.
        along: (n, p) unit vectors backward along the plates.
        turning: (n, p) rad/s.
    """

    place: np.ndarray
    velocity: np.ndarray
    along: np.ndarray
    turning: np.ndarray


class Plates:
    """The plates of a robot's head, tail links and caudal fin, in this order.

    Attributes:
        names: (p,) names of their geoms.
        half_m: (p, 3) half sizes along, across and upright.
    """

    def __init__(self, robot: RobotSpec, scene: Scene) -> None:
        hinge_x = robot.hinge_x_m
        ends = np.append(hinge_x[1:], robot.fin_root_x_m)
        half, fin, segments = (ends - hinge_x) / 2, robot.caudal_fin, robot.tail.segment
        self.names = ("head_fluid", *(f"{hinge}_plate" for hinge in robot.hinges), "caudal_fin")
        self.half_m = np.array(
            [
                robot.head.fluid_half_size_m,
                *((h, s.thickness_m / 2, s.half_height_m) for h, s in zip(half, segments, strict=True)),
                (fin.chord_m / 2, fin.thickness_m / 2, fin.span_m / 2),
            ]
        )
        self._link = np.array([*range(len(robot.links)), len(robot.hinges)])  # (p,) that carries each plate
        x, y, _ = robot.head.fluid_centre_m
        own = np.array([x + 1j * y, *half, robot.fin_root_x_m + fin.centre_m - hinge_x[-1]])  # (p,) on its link
        before = np.arange(len(robot.links)) < self._link[:, None]
        steps = np.append(np.diff(hinge_x, prepend=0.0), 0.0)
        self._arm = np.where(before, steps, 0.0).astype(complex)  # (p, l) way to each plate along each link
        self._arm[np.arange(len(own)), self._link] = own
        self._free = not scene.head_clamped
        self._hinges = slice(_HEAD_JOINTS * self._free + 1, None)  # behind the crank

    def motion(self, position: np.ndarray, velocity: np.ndarray) -> Motion:
        """Return where the plates are and how they move.

        Args:
            position: (n, q) positions of the joints.
            velocity: (n, v) velocities of the joints.
        """
        place, heading = self._chain(position)
        drift, turning = self._chain(velocity)
        ahead, link = np.exp(1j * heading), self._link
        return Motion(
            place + ahead @ self._arm.T,
            drift + (1j * turning * ahead) @ self._arm.T,
            ahead[:, link],
            turning[:, link],
        )

    def generalised(self, force: np.ndarray, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return the generalised forces (n, v) on the joints, N and N m, of forces and torques on the plates.

        Args:
            force: (n, p) on the centres, N.
            motion: motion of the plates.
            torque: (n, p), N m.
        """
        links = motion.along[:, : self._arm.shape[1]]  # (n, l): the first plates are one on each link
        turned = np.imag(links.conj() * (force @ self._arm.conj()))  # (n, l) on each link's heading
        if torque is not None:
            turned += torque @ (self._link[:, None] == np.arange(links.shape[1]))
        behind = np.cumsum(turned[:, ::-1], axis=1)[:, ::-1]  # a joint turns every link behind it
        joints = np.zeros((len(force), self._hinges.start + behind.shape[1] - 1))
        joints[:, self._hinges] = behind[:, 1:]
        if self._free:
            whole = force.sum(axis=1)
            joints[:, 0], joints[:, 1], joints[:, 2] = whole.real, whole.imag, behind[:, 0]
        return joints

    def _chain(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the position (n, 1) of the head's frame and the headings (n, l) of the links, or their rates."""
        bends = np.zeros((len(joints), self._arm.shape[1]))
        bends[:, 1:] = joints[:, self._hinges]
        if not self._free:
            return np.zeros((len(joints), 1), complex), np.cumsum(bends, axis=1)
        bends[:, 0] = joints[:, 2]
        return joints[:, :1] + 1j * joints[:, 1:2], np.cumsum(bends, axis=1)
