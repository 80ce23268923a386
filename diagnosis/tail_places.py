"""Places spread alike along the bent tail of a twin that swims: how they move, and what forces there do on the joints.

Plane rigid-body kinematics; vectors in the pool are complex numbers, x + i y.
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy.interpolate import make_interp_spline

from swimmer import RobotSpec

_PLACES = 12
SMOOTH = 5
"""Degree of splines: differences at a camera's rate would damp the third harmonic's acceleration."""


@dataclass(frozen=True, eq=False)
class TailPlaces:
    """p places from the first hinge to the caudal fin's centre, of a robot with h hinges, in n frames.

    Attributes:
        yaw_rad: (n,) of the head.
        normal: (n, p) across the part on which a place is, to its left.
        arms_m: (n, 1 + h, p) from the head's origin and each hinge to places; 0 where these lie ahead of it.
        speed_m_s, acceleration_m_s2: (n, p) in the pool.
    """

    yaw_rad: np.ndarray
    normal: np.ndarray
    arms_m: np.ndarray
    speed_m_s: np.ndarray
    acceleration_m_s2: np.ndarray

    @classmethod
    def of(cls, robot: RobotSpec, time_s: np.ndarray, head: np.ndarray, hinges_rad: np.ndarray) -> "TailPlaces":
        """Of x, y (m) and yaw (rad) of the head (n, 3), and hinges (n, h), at times (n,)."""
        joints_m = np.append(0.0, robot.hinge_x_m)
        last_m = robot.fin_root_x_m + robot.caudal_fin.centre_m
        places_m = np.linspace(robot.hinge_x_m[0], last_m, _PLACES + 1)[1:]
        part = np.searchsorted(robot.hinge_x_m, places_m)  # the joint next ahead of each
        along = np.exp(1j * np.cumsum(np.column_stack([head[:, 2], hinges_rad]), axis=1))  # (n, 1 + h)
        joint = np.cumsum(along[:, :-1] * np.diff(joints_m), axis=1)
        joint = np.column_stack([np.zeros(len(head)), joint])
        place = joint[:, part] + along[:, part] * (places_m - joints_m[part])
        behind = np.arange(len(joints_m))[:, None] <= part
        arms = np.where(behind, place[:, None] - joint[:, :, None], 0.0)
        in_pool = place + (head[:, 0] + 1j * head[:, 1])[:, None]
        spline = make_interp_spline(time_s, np.hstack([in_pool.real, in_pool.imag]), SMOOTH)
        speed, faster = (both[:, :_PLACES] + 1j * both[:, _PLACES:] for both in (spline(time_s, nu=o) for o in (1, 2)))
        return cls(head[:, 2], 1j * along[:, part], arms, speed, faster)

    def kept(self, frames: np.ndarray) -> "TailPlaces":
        """Some of the frames, (n,) True for each."""
        return TailPlaces(*(getattr(self, each.name)[frames] for each in fields(self)))

    @property
    def speed_across_m_s(self) -> np.ndarray:
        """(n, p) of each place, across its part."""
        return np.asarray((self.speed_m_s * self.normal.conj()).real)

    def on_joints(self, force: np.ndarray) -> np.ndarray:
        """(n, 3 + h) along and across the head and about its origin, and about the hinges, of forces (n, p)."""
        whole = (force.sum(axis=1) * np.exp(-1j * self.yaw_rad))[:, None]
        moments = (self.arms_m.conj() * force[:, None]).imag.sum(axis=2)
        return np.hstack([whole.real, whole.imag, moments])
