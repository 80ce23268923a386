"""Planar chain: kinematics, mass matrix and inertial forces in closed form.

Coordinates q of a simulation are (x, y) of the head's origin and the angle psi_a of every link in the pool:
N = 2 + l numbers. In absolute angles the kinetic energy is

    T = 1/2 m |v|^2 + sum_a G_a psi_a' v . n_a + 1/2 sum_ab C_ab cos(psi_a - psi_b) psi_a' psi_b',

n_a the unit vector across link a, m_>a the mass beyond link a, d_a its reach, S_b and I_a first and second moment about
the origin, G_a = S_a + d_a m_>a, C_ab = d_a G_b for a < b and C_aa = I_a + d_a^2 m_>a (Featherstone 2008, Rigid Body
Dynamics Algorithms, chapter 2, gives the general form; here it is written out).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters


@dataclass(frozen=True, eq=False)
class Pose:
    """Places of the links and how they move."""

    angle_rad: np.ndarray  # (n, l) angle psi of each link in the pool
    rate_rad_s: np.ndarray  # (n, l) rate of that angle
    direction: np.ndarray  # (n, l) unit vectors along the links, complex
    origin_m: np.ndarray  # (n, l) origins of the links, complex, m
    velocity_m_s: np.ndarray  # (n, l) velocities of the origins, complex, m/s

    @cached_property
    def relative(self) -> np.ndarray:
        """(n, l, l) unit vectors at the angles psi_a - psi_b, complex."""
        return self.direction[:, :, None] * self.direction.conj()[:, None, :]

    @property
    def hinge_rad(self) -> np.ndarray:
        """(n, h) angles of the hinges."""
        return np.diff(self.angle_rad, axis=1)

    @property
    def hinge_rate_rad_s(self) -> np.ndarray:
        """(n, h) rates of the hinges."""
        return np.diff(self.rate_rad_s, axis=1)


@dataclass(frozen=True, eq=False)
class Form:
    """The constants of a quadratic form in the velocities of all that the links carry, such as the kinetic energy."""

    total: np.ndarray  # (n,) sum of all weights (masses)
    moment: np.ndarray  # (n, l) G_a
    coupling: np.ndarray  # (n, l, l) C_ab

    def matrix(self, pose: Pose) -> np.ndarray:
        """Return the (n, N, N) matrix of the form in the coordinates' rates: for masses the mass matrix."""
        size = 2 + self.moment.shape[1]
        matrix = np.empty((len(self.total), size, size))
        matrix[:, 0, 0] = matrix[:, 1, 1] = self.total
        matrix[:, 0, 1] = matrix[:, 1, 0] = 0.0
        first = self.moment * pose.direction
        matrix[:, 0, 2:] = matrix[:, 2:, 0] = -first.imag
        matrix[:, 1, 2:] = matrix[:, 2:, 1] = first.real
        matrix[:, 2:, 2:] = self.coupling * pose.relative.real
        return matrix


class Chain:
    """The rigid-body dynamics of n simulations."""

    def __init__(self, layout: Layout, parameters: Parameters) -> None:
        self.reach_m = layout.reach_m
        self._ahead = np.triu(np.broadcast_to(self.reach_m[:, None], (len(self.reach_m),) * 2), 1)
        p = parameters
        self._bodies = self.form(p.link_mass_kg, p.link_moment_kg_m, p.link_inertia_kg_m2)

    def form(self, weight: np.ndarray, moment: np.ndarray, second_moment: np.ndarray) -> Form:
        """Build the form of weights on the links (n, l), with their first and second moments about the origins."""
        beyond = _sum_beyond(weight)
        whole = moment + self.reach_m * beyond
        upper = self._ahead * whole[:, None, :]
        coupling = upper + np.swapaxes(upper, 1, 2)
        links = np.arange(len(self.reach_m))
        coupling[:, links, links] += second_moment + self.reach_m**2 * beyond
        return Form(weight.sum(axis=1), whole, coupling)

    def pose(self, position: np.ndarray, velocity: np.ndarray) -> Pose:
        """Compute the kinematics at coordinates (n, N) and their rates (n, N)."""
        angle, rate = position[:, 2:], velocity[:, 2:]
        direction = np.cos(angle) + 1j * np.sin(angle)
        step = self.reach_m * direction
        return Pose(
            angle_rad=angle,
            rate_rad_s=rate,
            direction=direction,
            origin_m=(position[:, :1] + 1j * position[:, 1:2]) + _sum_before(step),
            velocity_m_s=(velocity[:, :1] + 1j * velocity[:, 1:2]) + 1j * _sum_before(step * rate),
        )

    def inertia(self, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Return the (n, N, N) mass matrix and (n, N) inertial force, minus all terms in the rates squared."""
        squared = pose.rate_rad_s**2
        pulled = (self._bodies.moment * pose.direction * squared).sum(axis=1, keepdims=True)
        turned = -((self._bodies.coupling * pose.relative.imag) @ squared[:, :, None])[..., 0]
        return self._bodies.matrix(pose), np.concatenate([pulled.real, pulled.imag, turned], axis=1)

    def generalised(self, pose: Pose, force: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Generalise forces (..., l) at the links' origins and torques (..., l) about them: (..., N).

        Args:
            pose: pose of the links; broadcast against leading axes of the forces after the first, as (n, 1, l).
            force: (n, ..., l) forces, complex, pool axes, N.
            torque: (n, ..., l) torques, N m.
        """
        direction = pose.direction.reshape(len(force), *(1,) * (force.ndim - 2), -1)
        total = force.sum(axis=-1, keepdims=True)
        beyond = _sum_beyond(force)
        turned = torque + (direction.conj() * beyond).imag * self.reach_m
        return np.concatenate([total.real, total.imag, turned], axis=-1)

    def across(self, pose: Pose) -> np.ndarray:
        """Return the (n, N, l) gradient of the velocity across each link, at its origin, to the coordinates' rates."""
        count, links = pose.direction.shape
        gradient = np.empty((count, 2 + links, links))
        gradient[:, 0], gradient[:, 1] = -pose.direction.imag, pose.direction.real
        gradient[:, 2:] = self._ahead * pose.relative.real
        return gradient

    def centripetal(self, pose: Pose) -> np.ndarray:
        """Return the (n, l) acceleration of the links' origins, complex, where no coordinate accelerates."""
        return -_sum_before(self.reach_m * pose.direction * pose.rate_rad_s**2)


def _sum_beyond(values: np.ndarray) -> np.ndarray:
    """Return (..., l) sums over all later links."""
    return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1] - values


def _sum_before(values: np.ndarray) -> np.ndarray:
    """Return (..., l) sums over all earlier links."""
    return np.cumsum(values, axis=-1) - values
