"""Effects of crank and tendons: arm, compliance, slack, friction and asymmetry.

`TendonPath` is the path of both tendons from the crank through the guides, on which the forces of `LooseTendons` and of
friction in the guides act.
"""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from swimcal.effects.effect import Effect, Parameter, StepDamper, StepDamping, StepForce, StepState
from swimcal.mjcf import SIDES, Scene
from swimcal.robot import RobotSpec

_EDGE_M = 1e-4  # length over which a tendon's damper comes in before its spring does
_TINY_M = 1e-12  # keeps the share of no slack finite
CREEP_M_S = 0.002
"""Speed of a line through a guide at which friction has 0.7 of its full force."""


class Spans(NamedTuple):
    """The straight pieces of both tendons, one over each hinge, of n simulations.

    Attributes:
        length_m: (n, 2, h) left and right.
        per_hinge: (n, 2, h) by how much each grows with the angle of its own hinge, m/rad.
    """

    length_m: np.ndarray
    per_hinge: np.ndarray


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
        """Return the pieces of both tendons at crank angles (n,) and hinge angles (n, h)."""
        sin, cos = np.sin(crank_rad)[:, None] * self._arm, np.cos(crank_rad)[:, None] * self._arm  # (n, 2)
        c, s = np.cos(hinges_rad)[:, None], np.sin(hinges_rad)[:, None]
        x, y = self._to[..., 0], self._to[..., 1]
        end_x, end_y = c * x - s * y, s * x + c * y  # (n, 2, h)
        piece_x, piece_y, up = end_x - self._from[..., 0], end_y - self._from[..., 1], -self._from[0, 0, 2] - cos
        piece_x[:, :, 0] -= sin
        length = np.sqrt(piece_x**2 + piece_y**2)
        length[:, :, 0] = np.hypot(length[:, :, 0], up)
        per_hinge = (piece_y * end_x - piece_x * end_y) / length
        return Spans(length, per_hinge)

    def straight(self) -> Spans:
        """Return the pieces of the straight tail at crank angle 0, where the tendons are cut to length."""
        return self(np.zeros(1), np.zeros((1, self._to.shape[1])))


def rest_lengths(spec: mujoco.MjSpec, robot: RobotSpec) -> np.ndarray:
    """Return the range of rest lengths (2, 2) of the left and the right tendon, m: as set, or of the straight tail.

    Left to the compiler they would follow the hinges' own rest angles.
    """
    set_m = np.array([spec.tendon(f"tendon_{side}").springlength for side, _ in SIDES])
    return np.where(set_m < 0, TendonPath(robot).straight().length_m[0].sum(axis=-1)[:, None], set_m)


def set_rest_lengths(spec: mujoco.MjSpec, length_m: np.ndarray) -> None:
    """Set the rest lengths (2, 2), in the order of `rest_lengths`."""
    for (side, _), length in zip(SIDES, length_m, strict=True):
        spec.tendon(f"tendon_{side}").springlength = length


class TendonEffect(Effect):
    """Effect of crank or tendons."""

    family = "tendons"
    stage = "tail"
    seen_in = frozenset({"dry", "swim"})


class CrankArmError(TendonEffect):
    """The tendons are pulled further, or less far, by the share `relative`."""

    name = "crank_arm_error"
    physics = "The tendon's stroke, and with it the tail's amplitude, grows with the radius of its anchor."
    source = "Geometry; the paper identifies 39.5 mm where 40 mm were measured."
    parameters = (Parameter("relative", "1", -0.25, 0.25, 0.05),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """Return the robot with another crank arm."""
        return robot.changed(crank={"arm_m": float(robot.crank.arm_m * (1 + values[0]))})


class TendonCompliance(TendonEffect):
    """The tendons, or what holds them, give (1 + `relative`) times as much under the same force."""

    name = "tendon_compliance"
    physics = "Line, knots and anchors are springs in series: their compliances 1/k add up."
    source = "Hooke's law; spring and damper change together, as with a longer piece of the same line."
    parameters = (Parameter("relative", "1", 0.0, 20.0, 2.0),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Soften the springs, with the same time constant."""
        if values[0] > 0 and scene.with_tendons:
            for side, _ in SIDES:
                tendon = spec.tendon(f"tendon_{side}")
                tendon.stiffness = tendon.stiffness / (1 + values[0])
                tendon.damping = tendon.damping / (1 + values[0])


class LooseTendons:
    """Damper that takes a share of their damping from tendons while they hang loose.

    The plain twin's dampers act parallel to its springs, strong for the sake of the time step: they would drag the tail
    along through the whole dead band.

    Args:
        robot: the robot.
        models: n models of it, each with its slack.
        share: (n,) share of the damping that is taken.
    """

    def __init__(self, robot: RobotSpec, models: Sequence[mujoco.MjModel], share: np.ndarray) -> None:
        radius = np.array([model.site("anchor_right").pos[2] for model in models])
        self._path = TendonPath(robot, radius)
        self._rest = np.array([model.tendon_lengthspring for model in models])  # (n, 2, 2)
        self._damping = share[:, None] * np.array([model.tendon_damping for model in models])  # (n, 2)
        self._half_step_s = models[0].opt.timestep / 2
        self._crank = -len(robot.hinges) - 1

    def __call__(self, state: StepState) -> StepDamping:
        """Return the damping for the next step, by the lengths in its middle."""
        middle = (state.position + self._half_step_s * state.velocity)[:, self._crank :]
        length = self._path(middle[:, 0], middle[:, 1:]).length_m.sum(axis=-1)
        beyond = np.maximum(self._rest[..., 0] - length, length - self._rest[..., 1])
        loose = np.where(self._rest[..., 0] < self._rest[..., 1], np.clip(-beyond / _EDGE_M, 0.0, 1.0), 0.0)
        return StepDamping(tendons=-self._damping * loose)


class TendonSlack(TendonEffect):
    """Each tendon is too long by `length` and `dragging`: between pulling and pushing is a dead band of twice that.

    Within it a line that is long by `length` alone leaves the tail free; with `dragging` alone it damps as before.
    """

    name = "tendon_slack"
    physics = "A loose line pulls only after its slack is taken up; a pair of lines leaves the tail free in between."
    source = "Dead band of a cable drive; MuJoCo's tendon springlength with two values."
    parameters = (Parameter("length", "m", 0.0, 0.01, 0.001), Parameter("dragging", "m", 0.0, 0.01, 0.001))

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Give each tendon a range of lengths at rest."""
        if values.any() and scene.with_tendons:
            set_rest_lengths(spec, rest_lengths(spec, robot) + values.sum() * np.array([-1.0, 1.0]))

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> StepDamper | None:
        """Return a damper that drags less while the tendons hang loose, by the share that `length` has of the slack."""
        if not (values[:, 0].any() and scene.with_tendons):
            return None
        return LooseTendons(robot, models, values[:, 0] / np.maximum(values.sum(axis=1), _TINY_M))


class TendonFriction(TendonEffect):
    """Each line loses `force` of its pull at each guide that it slides through; it ends in the last one.

    There is no guide before the first hinge.
    """

    name = "tendon_friction"
    physics = "Coulomb friction in the guides: the pull falls from guide to guide, and the rear of the tail lags."
    source = "Coulomb (1785), of constant force where Euler's capstan has one in proportion to the pull."
    parameters = (Parameter("force", "N", 0.0, 5.0, 0.5),)

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return the force that gives back the excess of the damping."""
        return _Guides(robot, values).given_back if values.any() and scene.with_tendons else None

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> StepDamper | None:
        """Return damping that is at least the friction."""
        return _Guides(robot, values).damping if values.any() and scene.with_tendons else None


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
        """Return the rates (n, h) of the hinges, and the factors k (n, g) of the guides."""
        rate = state.velocity[:, -self._arms_m.shape[1] :]
        return rate, 2 * self._force_n / np.hypot(rate @ self._arms_m.T, CREEP_M_S)

    def damping(self, state: StepState) -> StepDamping:
        """Return the damping D."""
        joints = np.zeros_like(state.velocity)
        joints[:, -self._arms_m.shape[1] :] = self._bound(self.rates(state)[1])
        return StepDamping(joints=joints)

    def given_back(self, state: StepState) -> np.ndarray:
        """Return the force (D - A) w, by which the damping exceeds the friction."""
        rate, k = self.rates(state)
        joints = np.zeros_like(state.velocity)
        joints[:, -rate.shape[1] :] = self._bound(k) * rate - (k * (rate @ self._arms_m.T)) @ self._arms_m
        return joints

    def _bound(self, k: np.ndarray) -> np.ndarray:
        sizes = np.abs(self._arms_m)
        return np.asarray(k @ (sizes * sizes.sum(axis=1, keepdims=True)))


class TendonAsymmetry(TendonEffect):
    """The left tendon is shorter by `length` and the right one longer: the tail is pulled to the left."""

    name = "tendon_asymmetry"
    physics = "Lines that were cut or wound unequally move the middle of the beat to one side."
    source = "Geometry: a shift of the tail's path length equal to a shift of the crank's stroke."
    parameters = (Parameter("length", "m", -0.006, 0.006, 0.001),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Set unequal lengths at rest."""
        if values[0] and scene.with_tendons:
            set_rest_lengths(spec, rest_lengths(spec, robot) + values[0] * np.array([[-1.0], [1.0]]))


EFFECTS: tuple[Effect, ...] = (
    CrankArmError(),
    TendonCompliance(),
    TendonSlack(),
    TendonFriction(),
    TendonAsymmetry(),
)
