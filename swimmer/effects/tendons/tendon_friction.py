"""Tendons that rub in their guides."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepForce, StepState
from swimmer.effects.step_damping import StepDamping
from swimmer.effects.tendons.path import TendonPath
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

CREEP_M_S = 0.002
"""Speed of a line through a guide at which friction has 0.7 of its full force."""


class _Guides:
    """Friction F u / sqrt(u^2 + `CREEP_M_S`^2) of both lines at every guide that they slide through at speed u.

    How far a line slides through a guide is how much longer its way behind it has become: u = sum a_j w_j over the
    hinges behind, with the line's arm a_j at each (of the straight tail) and its rate w_j. So guides couple hinges, by
    a matrix A = sum k a a', k = 2 F / sqrt(u^2 + `CREEP_M_S`^2). The engine's own damping has no such matrix: it is
    given D = the sums of the sizes in A's rows, and D - A is given back at the speed of now. Since neither A nor D - A
    is ever negative, that cannot grow.
    """

    def __init__(self, robot: RobotSpec, force_n: np.ndarray) -> None:
        arms = TendonPath(robot).straight().per_hinge[0, 0]
        behind = np.arange(len(arms)) > np.arange(len(arms) - 1)[:, None]
        self._arms_m, self._force_n = arms * behind, force_n  # (g, h), (n, 1)

    def rates(self, state: StepState) -> tuple[np.ndarray, np.ndarray]:
        """(n, h) rates of the hinges, and (n, g) k of the guides."""
        rate = state.velocity[:, -self._arms_m.shape[1] :]
        return rate, 2 * self._force_n / np.hypot(rate @ self._arms_m.T, CREEP_M_S)

    def damping(self, state: StepState) -> StepDamping:
        """D."""
        joints = np.zeros_like(state.velocity)
        joints[:, -self._arms_m.shape[1] :] = self._bound(self.rates(state)[1])
        return StepDamping(joints=joints)

    def given_back(self, state: StepState) -> np.ndarray:
        """(D - A) w."""
        rate, k = self.rates(state)
        joints = np.zeros_like(state.velocity)
        joints[:, -rate.shape[1] :] = self._bound(k) * rate - (k * (rate @ self._arms_m.T)) @ self._arms_m
        return joints

    def _bound(self, k: np.ndarray) -> np.ndarray:
        sizes = np.abs(self._arms_m)
        return np.asarray(k @ (sizes * sizes.sum(axis=1, keepdims=True)))


class TendonFriction(Effect):
    """Each line loses `force` of its pull at each guide that it slides through; it ends in the last one.

    There is no guide before the first hinge.
    """

    name = "tendon_friction"
    family = "tendons"
    stage = "tail"
    physics = "Coulomb friction in the guides: the pull falls from guide to guide, and the rear of the tail lags."
    source = "Coulomb (1785), of constant force where Euler's capstan has one in proportion to the pull."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("force", "N", 0.0, 5.0, 0.5),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """What the damping is too much."""
        return _Guides(robot, values).given_back if values.any() and scene.with_tendons else None

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> Callable[[StepState], StepDamping] | None:
        """More than the friction."""
        return _Guides(robot, values).damping if values.any() and scene.with_tendons else None


EFFECT = TendonFriction()
