"""Planar forward kinematics of the chain, vectorised: joint positions -> marker positions.

Faster than asking the engine for its sites at every frame, and exact at interpolated times.
"""

import numpy as np

from swimmer.robot import RobotSpec


class MarkerKinematics:
    """Positions of m chosen markers, in the order given, as a function of the planar pose of the chain."""

    def __init__(self, robot: RobotSpec, names: tuple[str, ...]) -> None:
        origins = np.concatenate([[0.0], robot.hinge_x_m])  # (l,) of each link on the straight robot
        self._steps = np.diff(origins)  # (h,) from each link's origin to the next
        self._link = np.array([robot.links.index(robot.markers[n].body) for n in names])  # (m,)
        local = robot.marker_positions_m(names)[:, :2]
        local[:, 0] -= origins[self._link]
        self._local = local  # (m, 2)

    def __call__(self, head: np.ndarray, hinges_rad: np.ndarray) -> np.ndarray:
        """Return the marker positions in the pool.

        Args:
            head: (..., 3) x, y (m) and yaw (rad) of the head's frame.
            hinges_rad: (..., h) hinge angles.

        Returns:
            (..., m, 2) m.
        """
        heading = np.concatenate([head[..., 2:], head[..., 2:] + np.cumsum(hinges_rad, axis=-1)], axis=-1)
        cos, sin = np.cos(heading), np.sin(heading)  # (..., l)
        steps = np.stack([self._steps * cos[..., :-1], self._steps * sin[..., :-1]], axis=-1)  # (..., h, 2)
        origin = np.concatenate([head[..., None, :2], head[..., None, :2] + np.cumsum(steps, axis=-2)], axis=-2)
        cos, sin = cos[..., self._link], sin[..., self._link]  # (..., m)
        x, y = self._local.T
        return origin[..., self._link, :] + np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)

    def axes(self, head: np.ndarray, hinges_rad: np.ndarray) -> np.ndarray:
        """Return the axes of the link that carries each marker.

        Args:
            head: (..., 3) x, y (m) and yaw (rad) of the head's frame.
            hinges_rad: (..., h) hinge angles.

        Returns:
            (..., m, 2, 2) unit vectors in the pool along x and y of the link.
        """
        heading = np.concatenate([head[..., 2:], head[..., 2:] + np.cumsum(hinges_rad, axis=-1)], axis=-1)
        cos, sin = np.cos(heading)[..., self._link], np.sin(heading)[..., self._link]
        return np.stack([np.stack([cos, sin], axis=-1), np.stack([-sin, cos], axis=-1)], axis=-2)
