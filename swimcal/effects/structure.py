"""Effects of the tail's hinges and masses: stiffness, damping, friction, a bend at rest, mass and entrained water."""

from collections.abc import Sequence

import mujoco
import numpy as np

from swimcal.effects.effect import Effect, Parameter, StepDamper, StepDamping, StepState
from swimcal.effects.tendons import rest_lengths, set_rest_lengths
from swimcal.mjcf import Scene
from swimcal.robot import RobotSpec

CREEP_RAD_S = 0.02
"""Speed at which friction has 0.7 of its full torque: a beat reaches some radians a second."""


class TailEffect(Effect):
    """Effect of the hinges or masses of the tail; every kind of trial shows it."""

    family = "structure"
    stage = "tail"
    seen_in = frozenset({"free_decay", "dry", "swim"})


class StiffnessError(TailEffect):
    """All hinges are stiffer by the share `relative`."""

    name = "stiffness_error"
    physics = "The restoring torque of every hinge differs by the same share."
    source = "Hooke's law; plates bend with the cube of a thickness that printing holds to a few hundredths."
    parameters = (Parameter("relative", "1", -0.3, 1.5, 0.1),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """Return the robot with stiffer hinges."""
        stiffness = float(robot.tail.hinge_stiffness_n_m * (1 + values[0]))
        return robot.changed(tail={"hinge_stiffness_n_m": stiffness})


class StiffnessGradient(TailEffect):
    """Stiffness goes evenly from (1 - `relative`) at the first hinge to (1 + `relative`) times at the last.

    The mean over the hinges stays.
    """

    name = "stiffness_gradient"
    physics = "Hinges of unequal height or thickness share the bend unequally."
    source = "Hooke's law; a plate's bending stiffness is E h t^3 / 12 a length."
    parameters = (Parameter("relative", "1", -0.8, 0.8, 0.2),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Give each hinge its own stiffness."""
        if values[0] and len(robot.hinges) > 1:
            for hinge, place in zip(robot.hinges, np.linspace(-1.0, 1.0, len(robot.hinges)), strict=True):
                joint = spec.joint(hinge)
                joint.stiffness = joint.stiffness * (1 + values[0] * place)


class StiffnessHardening(TailEffect):
    """The torque of a hinge is k q (1 + `cubic` q^2)."""

    name = "stiffness_hardening"
    physics = "A flexible gap that closes on one side and stretches on the other resists more than in proportion."
    source = "Duffing (1918): the first odd term beyond Hooke's law."
    parameters = (Parameter("cubic", "1/rad^2", 0.0, 20.0, 2.0),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Set the third number of each hinge's stiffness, the factor of q^3."""
        if values[0] > 0:
            for hinge in robot.hinges:
                joint = spec.joint(hinge)
                joint.stiffness = joint.stiffness[0] * np.array([1.0, 0.0, values[0]])


class JointDamping(TailEffect):
    """All hinges damp more by the share `relative`."""

    name = "joint_damping"
    physics = "The torque against the motion of every hinge, in proportion to its speed, differs by the same share."
    source = "Kelvin-Voigt material; loss factors of printed plastics and rubbers vary severalfold."
    parameters = (Parameter("relative", "1", -0.5, 5.0, 0.5),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """Return the robot with more damping in its hinges."""
        damping = float(robot.tail.hinge_damping_n_m_s * (1 + values[0]))
        return robot.changed(tail={"hinge_damping_n_m_s": damping})


class DryFriction:
    """The torque against a hinge's motion, T w / sqrt(w^2 + `CREEP_RAD_S`^2) at speed w, as damping; T is (n, h), N m.

    The engine's own dry friction is no help: its solver foresees speeds without the hinges' implicit damping, which
    outweighs the lightest link's inertia 90 times in a step, and at the twin's step it errs by more than the effect.
    """

    def __init__(self, torque_n_m: np.ndarray) -> None:
        self._torque = torque_n_m

    def __call__(self, state: StepState) -> StepDamping:
        """Return the damping for the next step."""
        hinges = self._torque.shape[1]
        joints = np.zeros_like(state.velocity)
        joints[:, -hinges:] = self._torque / np.hypot(state.velocity[:, -hinges:], CREEP_RAD_S)
        return StepDamping(joints=joints)


class JointFriction(TailEffect):
    """A hinge resists its motion with the same torque at any speed."""

    name = "joint_friction"
    physics = "Coulomb friction: a torque against the hinge's motion that does not depend on its speed."
    source = "Coulomb (1785); smoothed about zero speed."
    parameters = (Parameter("torque", "N m", 0.0, 0.3, 0.03),)

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> StepDamper | None:
        """Return the same friction in every hinge."""
        return DryFriction(np.repeat(values, len(robot.hinges), axis=1)) if values.any() else None


class BendOffset(TailEffect):
    """Every hinge rests at `angle`; the tendons keep the lengths at which they hold the tail straight.

    So with tendons the tail bends only as far as they let it.
    """

    name = "bend_offset"
    physics = "Warped printing or creep moves the angle at which a hinge's torque is zero."
    source = "Hooke's law about another point."
    parameters = (Parameter("angle", "rad", -0.3, 0.3, 0.03),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Set the spring references of the hinges, but keep the tendons' rest lengths from following them."""
        if values[0]:
            for hinge in robot.hinges:
                spec.joint(hinge).springref = float(values[0])
            if scene.with_tendons:
                set_rest_lengths(spec, rest_lengths(spec, robot))


class MassDistribution(TailEffect):
    """A `share` of the head's mass is spread as the tail's own, others sit on the last segment and on the fin.

    The total stays. Lumps anywhere near the tip are a mixture of the last two.
    """

    name = "mass_distribution"
    physics = "Glue, guides, markers and lines weigh on the tail what was weighed of the whole robot alone."
    source = "Newton's second law; the tail's mass follows from volumes and densities, 75 g of 1.48 kg."
    parameters = (
        Parameter("share", "1", 0.0, 0.1, 0.01),
        Parameter("on_last_segment", "1", 0.0, 0.05, 0.005),
        Parameter("on_fin", "1", 0.0, 0.05, 0.005),
    )

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """Return the robot with lighter parts in the head, a denser tail and a heavier fin."""
        share, _, on_fin = map(float, values)
        if not values.any():
            return robot
        head_kg = sum(part.mass_kg for part in robot.head.part)
        heavier = 1 + share * head_kg / float(robot.tail_mass_kg.sum())
        left = 1 - float(values.sum())
        part = tuple(p.model_copy(update={"mass_kg": p.mass_kg * left}) for p in robot.head.part)
        moved = robot.changed(head={"part": part}).with_tail_mass_times(heavier)
        return moved.changed(caudal_fin={"mass_kg": moved.caudal_fin.mass_kg + on_fin * head_kg})

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Make the plate of the last segment heavier by what the head has lost to it."""
        if values[1]:
            head_kg = sum(part.mass_kg for part in robot.head.part) / (1 - float(values.sum()))
            spec.geom(f"{robot.hinges[-1]}_plate").mass += float(values[1]) * head_kg


class EntrainedWater(TailEffect):
    """A layer of water, `thickness` deep on both sides of the tail's plates and fin, moves as if it were part of them.

    Unlike added mass it weighs the same in all directions. It hangs on the plates' surface, so its moment of inertia is
    that of a plate.
    """

    name = "entrained_water"
    physics = "Skin, sponge and gaps hold water that takes part in every acceleration; in air it has run off."
    source = "Newton's second law for rho times the volume held."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("thickness", "m", 0.0, 0.02, 0.002),)

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Add the water's mass to the plates."""
        if values[0] > 0 and scene.in_water:
            for name in (*(f"{hinge}_plate" for hinge in robot.hinges), "caudal_fin"):
                plate = spec.geom(name)
                side_m2 = 4 * plate.size[0] * plate.size[2]
                plate.mass += float(2 * values[0] * side_m2 * robot.water.density_kg_m3)


EFFECTS: tuple[Effect, ...] = (
    StiffnessError(),
    StiffnessGradient(),
    StiffnessHardening(),
    JointDamping(),
    JointFriction(),
    BendOffset(),
    MassDistribution(),
    EntrainedWater(),
)
