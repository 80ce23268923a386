"""An effect: its parameters and the methods by which it changes model, drive, forces and view.

`Effect` is the base class of all that the plain twin leaves out; at zero strength the twin with it is the plain twin.
A subclass overrides one or more of the methods named in `WAYS`. What these receive is defined before it: `View` and
`Observation` for camera and tracker, `Drive` for the motor, `StepState` for forces at a time step.

`Plates` are the robot's plates in the water, one for each fluid geom of the model, for forces that the engine does not
know: their planar `Motion`, and the generalised forces of forces on them. Places, velocities and forces in the plane of
the pool are complex numbers, x + i y.
"""

from abc import ABC
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal, NamedTuple

import mujoco
import numpy as np

from swimcal.mjcf import Scene
from swimcal.robot import RobotSpec
from swimcal.runs import Turn
from swimcal.session_file import TrialKind

_HEAD_JOINTS = 3  # surge, sway, yaw: those of a head that is free

Family = Literal["measurement", "drive", "tendons", "structure", "fluid"]
Stage = Literal["camera", "drive", "body", "tail"]
"""Place on the way from command to picture where an effect makes its gap, as in `where.by_stage` of a diagnosis."""
WAYS = ("in_trial", "robot", "mjcf", "force", "damping", "drive", "turned_hz", "measured_hz", "clock", "observe")
MODEL_WAYS = ("robot", "mjcf")
"""Ways that make another model."""
MOVING_WAYS = (*MODEL_WAYS, "force", "damping")
"""Ways that move the fish otherwise, whatever its crank does."""


@dataclass(frozen=True, eq=False)
class View:
    """A camera that looks straight down, in the frame of the pool in which the simulated head starts at the origin.

    Attributes:
        axis_m: (2,) the point under the camera, m.
        down: (2,) unit vector in the pool that points down in the picture.
        half_height_m: from the picture's middle to its lower edge, at the height of the head's markers, m.
    """

    axis_m: np.ndarray
    down: np.ndarray
    half_height_m: float


@dataclass(frozen=True, eq=False)
class Observation:
    """The markers of one simulation before camera and tracker err.

    Attributes:
        time_s: (f,) times of the frames.
        marker_m: (f, m, 2) in the pool, m.
        axes: (f, m, 2, 2) unit vectors in the pool along x (backward) and y of the link that carries each marker.
        crank_rad: (f,) angle of the crank.
        names: names of the m markers.
        above_m: (m,) height of each over the markers of nose and neck, m.
        view: the camera.
    """

    time_s: np.ndarray
    marker_m: np.ndarray
    axes: np.ndarray
    crank_rad: np.ndarray
    names: tuple[str, ...]
    above_m: np.ndarray
    view: View


class Parameter(NamedTuple):
    """One number of an effect; zero is the plain twin.

    Attributes:
        name: unique within its effect.
        unit: SI, "1" for a ratio.
        low, high: bounds; an effect of one sign starts at 0.
        sd: standard deviation of its prior, normal about 0 and cut off at the bounds: how large it is on built robots.

    Example:
        >>> calib.Parameter("length", "m", low=0.0, high=0.01, sd=0.001).unit
        'm'
    """

    name: str
    unit: str
    low: float
    high: float
    sd: float


class Drive(NamedTuple):
    """Drive of a crank: frequency if it turns evenly, phase at time 0, and its turn from then on if it does not."""

    frequency_hz: float
    phase_rad: float
    turn: Turn | None


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


@dataclass(frozen=True, eq=False)
class StepState:
    """State of n simulations before a step, in the order of the joints.

    Attributes:
        time_s: time since the start.
        position: (n, q) surge, sway (m), yaw, crank and hinges (rad).
        velocity: (n, v).
        acceleration: (n, v) over the last step.
        fluid: (n, v) generalised force of the water in the last step, N and N m.
        plates: the robot's plates.
    """

    time_s: float
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    fluid: np.ndarray
    plates: Plates

    @cached_property
    def motion(self) -> Motion:
        """Motion of the plates, computed once for all effects."""
        return self.plates.motion(self.position, self.velocity)


class StepDamping(NamedTuple):
    """Damping added to n models for the next step, which the engine takes at the end of the step.

    So a force that is stiff in speed, as dry friction, does not limit the step: written as damping times speed it is
    taken at the new speed (Kacanov's linearisation). A force of an effect would be taken at the old one.

    Attributes:
        joints: (n, v) N s/m and N m s/rad, in the order of the joints.
        tendons: (n, 2) left and right, N s/m; 0 without tendons.
    """

    joints: np.ndarray | float = 0.0
    tendons: np.ndarray | float = 0.0


StepForce = Callable[[StepState], np.ndarray]
"""Function that returns the generalised force (n, v) on n simulations over the next step; it may have a memory."""
StepDamper = Callable[[StepState], StepDamping]
"""Function that adds to the damping of n simulations over the next step; it may have a memory."""


class Effect(ABC):
    """Something that real robots do and the plain twin does not.

    An effect is described by class attributes, and enters by whichever of the methods below it overrides. Each is
    given its own parameters as values (p,) and must change nothing at all where they are zero. A user's own effects are
    found through the entry point group ``swimcal.effects``.

    Attributes:
        name: as in a diagnosis.
        family, stage: where it belongs.
        physics: one line.
        source: paper, equation or law.
        seen_in: kinds of trials that can show it.
        needs_log: whether nothing but a motor log shows it; without one a diagnosis does not look for it.
        parameters: of which at least one is not zero where the effect is present.

    Example:
        >>> class WornGear(calib.Effect):
        ...     name, family, stage = "worn_gear", "drive", "drive"
        ...     physics, source = "The crank turns slower than the motor.", "its data sheet"
        ...     seen_in = frozenset({"dry", "swim"})
        ...     parameters = (calib.Parameter("share", "1", low=0.0, high=0.5, sd=0.1),)
        ...
        ...     def drive(self, drive, values):
        ...         return drive._replace(frequency_hz=drive.frequency_hz * (1 - values[0]))
        >>> swim = calib.load_twin(effects=[WornGear()]).swim(1.0, parameters={"worn_gear.share": [0.0, 0.2]})
        >>> bool(swim.speed[1] < swim.speed[0])
        True
    """

    name: ClassVar[str]
    family: ClassVar[Family]
    stage: ClassVar[Stage]
    physics: ClassVar[str]
    source: ClassVar[str]
    seen_in: ClassVar[frozenset[TrialKind]]
    needs_log: ClassVar[bool] = False
    parameters: tuple[Parameter, ...]

    def suited(self, robot: RobotSpec, markers: tuple[str, ...]) -> "Effect":
        """Return the same effect with the parameters that a robot has.

        Args:
            robot: the robot.
            markers: names of its markers.
        """
        return self

    def in_trial(self, view: View, values: np.ndarray) -> np.ndarray:
        """Turn the values of a session into those in the frame of one trial.

        Args:
            view: the camera of the trial.
            values: (p,) in the axes of the picture.
        """
        return values

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """Return the robot changed by the effect; hinges and markers stay in their places.

        Args:
            robot: the robot without the effect.
            values: (p,) of the effect.
        """
        return robot

    def mjcf(self, spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene, values: np.ndarray) -> None:
        """Change the model of a robot in a scene.

        Args:
            spec: the model; its fluid geoms all hold the same five coefficients.
            robot: the robot.
            scene: where it is.
            values: (p,) of the effect.
        """

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """Return a force that no model holds, for n simulations at once.

        Args:
            robot: the robot.
            scene: where it is.
            values: (n, p) of the effect; the force must be zero where they are.
        """
        return None

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> StepDamper | None:
        """Return damping that no model holds.

        Args:
            robot: the robot.
            scene: where it is.
            models: models of the n simulations, with all effects in them.
            values: (n, p) of the effect.
        """
        return None

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """Return the turn of the crank with the effect.

        Args:
            drive: the turn without it.
            values: (p,) of the effect.
        """
        return drive

    def turned_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """Return the frequency of a crank on a command, as a log of its motor shows it, Hz.

        Args:
            commanded_hz: the command.
            values: (p,) of the effect.
        """
        return commanded_hz

    def measured_hz(self, turned_hz: float, values: np.ndarray) -> float:
        """Return the frequency at which a tail is filmed, Hz.

        Args:
            turned_hz: turns of its crank a second.
            values: (p,) of the effect.
        """
        return turned_hz

    def clock(self, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the true times of frames, (f,), s.

        Args:
            time_s: (f,) times that the camera stamps.
            values: (p,) of the effect.
        """
        return time_s

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        """Return the positions (f, m, 2), m, where camera and tracker find the markers.

        Args:
            seen: the markers before camera and tracker err; ``seen.marker_m`` is the result without an error.
            values: (p,) of the effect.
        """
        return seen.marker_m

    @classmethod
    def enters(cls) -> tuple[str, ...]:
        """List the ways in which the effect enters: names of the methods it overrides."""
        return tuple(way for way in WAYS if getattr(cls, way) is not getattr(Effect, way))

    @classmethod
    def in_mjcf(cls) -> bool:
        """Tell whether a model in plain MJCF holds all of the effect."""
        return set(cls.enters()) <= {"in_trial", *MODEL_WAYS}

    def __repr__(self) -> str:
        return f"<effect {self.name}>"
