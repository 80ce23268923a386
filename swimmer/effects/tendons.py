"""Effects of crank and tendons."""

from collections.abc import Sequence

import mujoco
import numpy as np

from swimmer.effects.effect import Effect, Parameter, StepDamper, StepDamping, StepForce, StepState
from swimmer.effects.tendon_path import TendonPath, rest_lengths, set_rest_lengths
from swimmer.mjcf import SIDES, Scene
from swimmer.robot import RobotSpec


class CrankArmError(Effect):
    """The tendons are pulled further, or less far, by the share `relative`."""

    name = "crank_arm_error"
    family = "tendons"
    stage = "tail"
    physics = "The tendon's stroke, and with it the tail's amplitude, grows with the radius of its anchor."
    source = "Geometry; the paper identifies 39.5 mm where 40 mm were measured."
    seen_in = frozenset({"dry", "swim"})
    in_fit = True
    parameters = (Parameter("relative", "1", -0.25, 0.25, 0.05),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """With another arm."""
        arm_m = float(robot.crank.arm_m * (1 + values[0]))
        return robot.model_copy(update={"crank": robot.crank.model_copy(update={"arm_m": arm_m})})


class TendonCompliance(Effect):
    """The tendons, or what holds them, give (1 + `relative`) times as much under the same force."""

    name = "tendon_compliance"
    family = "tendons"
    stage = "tail"
    physics = "Line, knots and anchors are springs in series: their compliances 1/k add up."
    source = "Hooke's law; spring and damper change together, as with a longer piece of the same line."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("relative", "1", 0.0, 20.0, 2.0),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Softer springs, with the same time constant."""
        if values[0] > 0 and scene.with_tendons:
            for side, _ in SIDES:
                tendon = spec.tendon(f"tendon_{side}")
                tendon.stiffness = tendon.stiffness / (1 + values[0])
                tendon.damping = tendon.damping / (1 + values[0])


_EDGE_M = 1e-4  # over which a tendon's damper comes in before its spring does


class LooseTendons:
    """Takes the damping from tendons while they hang loose.

    The plain twin's dampers act parallel to its springs, strong for the sake of the time step: they would drag the
    tail along through the whole dead band.

    Args:
        robot: the robot.
        models: of the n simulations.
    """

    def __init__(self, robot: RobotSpec, models: Sequence[mujoco.MjModel]) -> None:
        radius = np.array([model.site("anchor_right").pos[2] for model in models])
        self._path = TendonPath(robot, radius)
        self._rest = np.array([model.tendon_lengthspring for model in models])  # (n, 2, 2)
        self._damping = np.array([model.tendon_damping for model in models])  # (n, 2)
        self._half_step_s = models[0].opt.timestep / 2
        self._crank = -len(robot.hinges) - 1

    def __call__(self, state: StepState) -> StepDamping:
        """For the next step, by the lengths in its middle."""
        middle = (state.position + self._half_step_s * state.velocity)[:, self._crank :]
        length = self._path(middle[:, 0], middle[:, 1:]).length_m.sum(axis=-1)
        beyond = np.maximum(self._rest[..., 0] - length, length - self._rest[..., 1])
        loose = np.where(self._rest[..., 0] < self._rest[..., 1], np.clip(-beyond / _EDGE_M, 0.0, 1.0), 0.0)
        return StepDamping(tendons=-self._damping * loose)


class TendonSlack(Effect):
    """Each tendon is too long by `length`: between pulling and pushing is a dead band of twice that."""

    name = "tendon_slack"
    family = "tendons"
    stage = "tail"
    physics = "A loose line pulls only after its slack is taken up; a pair of lines leaves the tail free in between."
    source = "Dead band of a cable drive; MuJoCo's tendon springlength with two values."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("length", "m", 0.0, 0.01, 0.001),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """A range of lengths at rest."""
        if values[0] > 0 and scene.with_tendons:
            set_rest_lengths(spec, rest_lengths(spec, robot) + values[0] * np.array([-1.0, 1.0]))

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> StepDamper | None:
        """None within it."""
        return LooseTendons(robot, models) if values.any() and scene.with_tendons else None


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
    ) -> StepDamper | None:
        """More than the friction."""
        return _Guides(robot, values).damping if values.any() and scene.with_tendons else None


class TendonAsymmetry(Effect):
    """The left tendon is shorter by `length` and the right one longer: the tail is pulled to the left."""

    name = "tendon_asymmetry"
    family = "tendons"
    stage = "tail"
    physics = "Lines that were cut or wound unequally move the middle of the beat to one side."
    source = "Geometry: a shift of the tail's path length equal to a shift of the crank's stroke."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("length", "m", -0.006, 0.006, 0.001),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Other lengths at rest."""
        if values[0] and scene.with_tendons:
            set_rest_lengths(spec, rest_lengths(spec, robot) + values[0] * np.array([[-1.0], [1.0]]))


EFFECTS: tuple[Effect, ...] = (
    CrankArmError(),
    TendonCompliance(),
    TendonSlack(),
    TendonFriction(),
    TendonAsymmetry(),
)
