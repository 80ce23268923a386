"""The twin with effects: a model of its own for every simulation, all in one batch."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Self, TypeVar

import mujoco
import numpy as np
from mujoco.batch import Batch
from scipy.interpolate import CubicSpline

from swimcal.effects.effect import (
    MODEL_WAYS,
    MOVING_WAYS,
    Drive,
    Effect,
    Observation,
    Plates,
    StepForce,
    StepState,
    View,
)
from swimcal.errors import Fault, InputError, shown
from swimcal.mjcf import DRY, FluidCoefficients, Scene, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.runs import Runs, Trajectories, quiet_engine
from swimcal.twin import FOLLOWING_N_M_S, Twin

# A slow turn of the crank brings a tail into its pose: lead before the pose, offsets for its slope, and speed.
_LEAD_RAD = 0.8
_ASIDE_RAD = 0.05
_SLOW_RAD_S = 1.6


T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class AffectedRuns(Runs):
    """Simulations with effects: values (n, p) are the parameters of all effects, one after the other."""

    values: np.ndarray = field(kw_only=True)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Join the runs of several parts, one after the other."""
        return replace(super().joined(parts), values=np.concatenate([part.values for part in parts]))

    def _numbers(self) -> list[np.ndarray]:
        return [*super()._numbers(), self.values]


class AffectedTwin(Twin):
    """A twin with effects, in the order in which they act; at zero values it is the plain twin to the bit."""

    def __init__(self, twin: Twin, effects: Sequence[Effect]) -> None:
        super().__init__(twin.robot, twin.markers, twin.scene, twin.workers)
        self.plain = twin
        self.effects = tuple(effect.suited(twin.robot, twin.markers) for effect in effects)
        ends = np.cumsum([0, *(len(effect.parameters) for effect in self.effects)])
        # Each effect with the columns of its parameters among all values.
        self._own = [(e, slice(a, b)) for e, a, b in zip(self.effects, ends[:-1], ends[1:], strict=True)]
        self.size = int(ends[-1])  # number of values

    def at_step(self, timestep_s: float) -> "AffectedTwin":
        """Return the same twin with another time step, s."""
        return AffectedTwin(self.plain.at_step(timestep_s), self.effects)

    def of_robot(self, robot: RobotSpec) -> "AffectedTwin":
        """Return the same twin of another robot."""
        return AffectedTwin(self.plain.of_robot(robot), self.effects)

    def simulate(self, runs: Runs, time_s: np.ndarray, *, allow_divergence: bool = False) -> Trajectories:
        """Simulate as the plain twin does, with runs that are `AffectedRuns` and times that the camera stamps.

        Args:
            runs: n simulations.
            time_s: (f,) common to all or (n, f), stamped by the camera, s.
            allow_divergence: return nan and mark what diverges instead of raising.

        Raises:
            ValueError: the values are not those of the effects.
            InputError: an effect gives an array of another shape than it should.
        """
        values = self._values(runs)
        stamped = np.broadcast_to(time_s, (len(runs), time_s.shape[-1]))
        true_s = np.array([self._true_s(t, v) for t, v in zip(stamped, values, strict=True)])
        trajectories = super().simulate(
            self._drive(runs, values), np.maximum(true_s, 0.0), allow_divergence=allow_divergence
        )
        return replace(trajectories, time_s=time_s)

    def observed(self, runs: Runs, trajectories: Trajectories, view: View) -> np.ndarray:
        """Return the marker positions (n, f, m, 2) that a camera finds in simulations, m.

        Args:
            runs: the n simulations.
            trajectories: what they gave.
            view: the camera.

        Raises:
            InputError: an effect gives an array of another shape than it should.
        """
        robot, markers = self.robot, self.markers
        heights = robot.marker_positions_m(markers)[:, 2]
        above = heights - robot.marker_positions_m(("nose", "neck"))[:, 2].mean()
        axes = self._kinematics.axes(trajectories.head, trajectories.hinges_rad)
        times = np.broadcast_to(trajectories.time_s, trajectories.marker_m.shape[:2])
        seen = np.empty_like(trajectories.marker_m)
        for i, values in enumerate(self._values(runs)):
            seen[i] = trajectories.marker_m[i]
            for effect, columns in self._own:
                one = Observation(times[i], seen[i], axes[i], trajectories.crank_rad[i], markers, above, view)
                seen[i] = _check_shape(seen[i].shape, effect, "observe", effect.observe(one, values[columns]))
        return seen

    def tracked(self, runs: Runs, trajectories: Trajectories, view: View) -> np.ndarray:
        """Return the marker positions (n, f, m, 2) that tracks would show.

        They are those of `observed`, scaled by nose and neck.

        Args:
            runs: the n simulations.
            trajectories: what they gave.
            view: the camera.
        """
        seen = self.observed(runs, trajectories, view)
        nose, neck = (self.markers.index(name) for name in ("nose", "neck"))
        span = np.median(np.linalg.norm(seen[:, :, nose] - seen[:, :, neck], axis=-1), axis=1)
        return np.asarray((self.robot.scale_length_m / span)[:, None, None, None] * seen)

    def in_trial(self, view: View, values: np.ndarray) -> np.ndarray:
        """Turn the values of a session into those in the frame of one trial.

        Args:
            view: the camera of the trial.
            values: (p,) of all effects, in the axes of the picture.
        """
        moved = [effect.in_trial(view, values[columns]) for effect, columns in self._own]
        return np.concatenate([np.zeros(0), *moved])

    def turned_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """Return the frequency of the crank that a command leads to, Hz.

        Args:
            commanded_hz: the command.
            values: (p,) of all effects.
        """
        return float(self._apply("turned_hz", commanded_hz, values))

    def measured_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """Return the frequency that a camera measures on a command, Hz.

        Args:
            commanded_hz: the command.
            values: (p,) of all effects.
        """
        return float(self._apply("measured_hz", self.turned_hz(commanded_hz, values), values))

    def beats_hz(self, runs: Runs, time_s: np.ndarray) -> np.ndarray:
        """Return the frequency (n,) of each crank on the camera's clock, Hz.

        It is the slope of the crank's turn over the stamped times.

        Args:
            runs: the n simulations.
            time_s: (f,) times that the camera stamps.
        """
        values, found = self._values(runs), []
        driven = self._drive(runs, values)
        turns = driven.turns or (None,) * len(runs)
        for hz, turn, own in zip(driven.frequency_hz, turns, values, strict=True):
            true_s = np.maximum(self._true_s(time_s, own), 0.0)
            angle = 2 * np.pi * hz * true_s if turn is None else turn.angle(true_s)
            found.append(np.polyfit(time_s - time_s.mean(), angle, 1)[0] / (2 * np.pi))
        return np.array(found)

    def spec(self, coefficients: FluidCoefficients, values: np.ndarray, scene: Scene | None = None) -> mujoco.MjSpec:
        """Build the MJCF of the robot with as much of the effects as a model can hold.

        Args:
            coefficients: MuJoCo's five fluid coefficients.
            values: (p,) of all effects.
            scene: water or air, head free or clamped, tendons or none; by default the twin's.
        """
        scene = scene or self.scene
        robot: RobotSpec = self._apply("robot", self.robot, values)
        spec = build_mjcf(robot, coefficients, scene)
        for effect, columns in self._own:
            effect.mjcf(spec, robot, scene, values[columns])
        return spec

    def start(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """Return the plain twin's start, corrected by how far models with the effects settle elsewhere."""
        position, velocity = super().start(runs)
        changes_models = any(way in effect.enters() for effect in self.effects for way in MODEL_WAYS)
        if changes_models and self.scene.with_tendons:
            by, slope = self._rest_pose_change(runs)
            position[:, self._hinges] += by
            velocity[:, self._hinges] += slope * runs.start_speed_rad_s[:, None]
        return position, velocity

    @property
    def _pose(self) -> CubicSpline:
        return self.plain._pose

    def _rest_pose_change(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """Return how far the pose at each run's phase is from the plain robot's (n, h), and its slope with phase."""
        scene, values = replace(DRY, timestep_s=self.scene.timestep_s), self._values(runs)
        both = np.column_stack([np.vstack([values, np.zeros_like(values)]), np.tile(runs.phase_rad, 2)])
        distinct, which = np.unique(both, axis=0, return_inverse=True)  # most trials of a session are equal
        some = FluidCoefficients(*runs.coefficients[0])
        models = [self.spec(some, v, scene).compile() for v in distinct[:, :-1]]
        batch = Batch(models[0], len(models), self.workers)
        batch.set_models(models)
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        first = distinct[:, -1] - _LEAD_RAD
        batch.bind("qpos")[:, 0], batch.bind("qpos")[:, 1:] = first, self._pose(first)
        batch.bind("qvel")[:, 0] = batch.bind("ctrl")[:, 0] = _SLOW_RAD_S
        turned = np.array([_LEAD_RAD - _ASIDE_RAD, _LEAD_RAD, _LEAD_RAD + _ASIDE_RAD])
        at = np.round(turned / (_SLOW_RAD_S * scene.timestep_s)).astype(int)
        with quiet_engine():
            rolled = batch.rollout(int(at[-1]) + 1, record=("qpos",))["qpos"]
        off = np.subtract(*np.split(rolled[which.ravel()][:, at, 1:], 2))  # (n, 3, h)
        slope = (off[:, 2] - off[:, 0]) / (_SLOW_RAD_S * scene.timestep_s * (at[2] - at[0]))
        return off[:, 1], slope

    def _batch(self, runs: Runs) -> Batch:
        models = self._models(np.column_stack([runs.coefficients, self._values(runs)]))
        for row, model in enumerate(models):
            turn = None if runs.turns is None else runs.turns[row]
            if turn is not None and turn.logged:
                model.actuator_gainprm[0, 0], model.actuator_biasprm[0, 2] = FOLLOWING_N_M_S, -FOLLOWING_N_M_S
            for name, fields in runs.fields.items():
                getattr(model, name)[:] = fields[row]
        batch = Batch(models[0], len(models), self.workers)
        batch.set_models(models)
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        return batch

    def _models(self, values: np.ndarray) -> list[mujoco.MjModel]:
        """Compile a model for each row of coefficients and values (n, 5 + p), once for those that are equal in these.

        Values of effects that leave models alone make no difference.
        """
        there = np.array(values)
        for effect, columns in self._own:
            if not set(effect.enters()) & set(MODEL_WAYS):
                there[:, 5:][:, columns] = 0.0
        first, which = np.unique(there, axis=0, return_inverse=True)
        compiled = [self.spec(FluidCoefficients(*row[:5]), row[5:]).compile() for row in first]
        return [copy(compiled[number]) for number in which.ravel()]

    def _roll(self, batch: Batch, runs: Runs, steps: np.ndarray) -> np.ndarray:
        forces, values = self._forces(runs), self._values(runs)
        made = [each.damping(self.robot, self.scene, batch.models, values[:, columns]) for each, columns in self._own]
        dampers = [damper for damper in made if damper is not None]
        if not forces and not dampers:
            return super()._roll(batch, runs, steps)
        fewest, most, dt = int(steps.min()), int(steps.max()), self.scene.timestep_s
        speeds = runs.crank_speeds(most, dt)
        position, velocity, fluid = (batch.bind(name) for name in ("qpos", "qvel", "qfrc_fluid"))
        applied, control = batch.bind("qfrc_applied"), batch.bind("ctrl")
        rolled, before = np.empty((len(runs), most, position.shape[1])), velocity.copy()
        acceleration = np.zeros_like(before)
        joints, tendons = ([getattr(m, name) for m in batch.models] for name in ("dof_damping", "tendon_damping"))
        joint_base, tendon_base, plates = np.array(joints), np.array(tendons), Plates(self.robot, self.scene)
        for k in range(most):
            state = StepState(k * dt, position, velocity, acceleration, fluid, plates)
            if forces:
                pushed = [force(state) for _, force in forces]
                for (effect, _), own in zip(forces, pushed, strict=True) if k == 0 else ():
                    _check_shape(applied.shape, effect, "force", own)
                applied[:] = sum(pushed)
            if dampers:
                added = [damper(state) for damper in dampers]
                _add(joints, joint_base, [a.joints for a in added])
                _add(tendons, tendon_base, [a.tendons for a in added])
            if speeds is not None:
                control[:, 0] = speeds[:, k, 0]
            batch.step(None if k < fewest else np.flatnonzero(steps > k))
            acceleration = (velocity - before) / dt
            before, rolled[:, k] = velocity.copy(), position
        for row, end in enumerate(steps):
            rolled[row, end:] = rolled[row, end - 1]  # what came of it after its end does not count
        return rolled

    def _distinct(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of distinct runs: those that differ only in cameras and clocks move alike."""
        if not isinstance(runs, AffectedRuns):
            return super()._distinct(runs)
        moves = np.zeros_like(runs.values)
        for effect, columns in self._own:
            if set(effect.enters()) & set(MOVING_WAYS):
                moves[:, columns] = runs.values[:, columns]
        return replace(runs, values=moves).distinct()

    def _forces(self, runs: Runs) -> list[tuple[Effect, StepForce]]:
        values = self._values(runs)
        made = ((effect, effect.force(self.robot, self.scene, values[:, own])) for effect, own in self._own)
        return [(effect, force) for effect, force in made if force is not None]

    def _drive(self, runs: Runs, values: np.ndarray) -> Runs:
        """Return the runs with cranks that turn as the effects make them."""
        turns = runs.turns or (None,) * len(runs)
        commanded = [
            Drive(float(f), float(p), t) for f, p, t in zip(runs.frequency_hz, runs.phase_rad, turns, strict=True)
        ]
        done: list[Drive] = [self._apply("drive", drive, v) for drive, v in zip(commanded, values, strict=True)]
        frequency_hz, phase_rad, turned = zip(*done, strict=True)
        return replace(
            runs,
            frequency_hz=np.array(frequency_hz),
            phase_rad=np.array(phase_rad),
            turns=turned if any(turned) else None,
        )

    def _true_s(self, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the true times (f,) of frames that the camera stamps with times (f,), s."""
        for effect, columns in self._own:
            time_s = _check_shape(time_s.shape, effect, "clock", effect.clock(time_s, values[columns]))
        return time_s

    def _apply(self, way: str, argument: T, values: np.ndarray) -> T:
        """Apply one method of all effects, one after the other."""
        for effect, columns in self._own:
            act: Callable[[T, np.ndarray], T] = getattr(effect, way)
            argument = act(argument, values[columns])
        return argument

    def _values(self, runs: Runs) -> np.ndarray:
        values = runs.values if isinstance(runs, AffectedRuns) else np.zeros((len(runs), self.size))
        if values.shape != (len(runs), self.size):
            raise ValueError(f"values: found shape {values.shape}, expected {(len(runs), self.size)}")
        return values


def _add(fields: Sequence[np.ndarray], base: np.ndarray, added: Sequence[np.ndarray | float]) -> None:
    """Add to fields of models, which the batch reads anew in every step."""
    changes = [each for each in added if isinstance(each, np.ndarray)]
    for own, row in zip(fields, base + sum(changes), strict=True) if changes else ():
        own[:] = row


def _check_shape(shape: tuple[int, ...], effect: Effect, way: str, given: np.ndarray) -> np.ndarray:
    """Check the shape of an array that an effect gave by one of its methods, and return it.

    Raises:
        InputError: it is of another shape, or no array.
    """
    if isinstance(given, np.ndarray) and given.shape == shape:
        return given
    own = type(effect)
    fault = Fault(
        file=f"effect {effect.name} ({own.__module__}.{own.__qualname__})",
        where=way,
        what="it gives the wrong shape" if isinstance(given, np.ndarray) else "it gives no array",
        found=str(given.shape) if isinstance(given, np.ndarray) else shown(given),
        expected=f"an array of shape {shape}",
        next_step=f"Mend {own.__qualname__}.{way}; swimcal/effects/effect.py says what each number of the shape is.",
    )
    raise InputError([fault])
