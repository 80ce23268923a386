"""Free decay as two numbers that a diagnosis reads: stiffness and damping against the description.

A released tail rings in air, without water and tendons, so its `Ring` depends on hinges, masses and the clock alone.
`ring_changes` tells how an effect moves the two numbers: the effect acts on a twin with the fitted hinges, released in
the fitted pose, which swings as the tail did, however far off the description is; its numbers are those of the hinges
with which the plain twin would swing as that one does. Both take the same step, whose error so cancels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fitting.decay_fit import NUMBERS, TO_COME_SD
from fitting.free_decay import DecayTrial
from fitting.hinges import DecayFit, DecayTwin, hinges_of, stable_scene, with_hinges
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.effect import Effect
from swimcal.mjcf import Scene
from swimcal.robot import RobotSpec
from swimcal.runs import Runs
from swimcal.twin import Twin

_MOVES = frozenset({"robot", "mjcf", "force", "damping", "clock"})  # ways in which an effect can change a decay
_NO_FLUID = 5  # number of fluid coefficients, on which nothing in air depends
# All in logarithms of the numbers.
_DIFFERENCE = 0.01  # finite difference
_LONGEST = 0.7  # longest step
_FAR = 0.05  # length of a step after which slopes are simulated anew
_SETTLED = 2e-3  # length of the last step
_ROUNDS = 6  # largest number of steps
_SLOPES = _DIFFERENCE * np.vstack([np.zeros(NUMBERS), np.eye(NUMBERS)])
_MOST = 2.0  # largest difference that hinges can make
_LASTS_S = 1.5  # length of a decay to come
_BENT_RAD = 0.2  # first angle of its hinges


@dataclass(frozen=True, eq=False)
class Ring:
    """Ring of a released tail: its hinges against their description.

    Attributes:
        trial: n frames of k tail markers, with those samples that the fit used.
        start_rad: (2, h) hinge angles (rad) and rates (rad/s) in the first frame.
        robot: the robot with hinges as fitted, else as described.
        residual: (2,) the fitted `NUMBERS` minus those of the description.
        sd: (2,) standard deviations by tracking noise.
    """

    trial: DecayTrial
    start_rad: np.ndarray
    robot: RobotSpec
    residual: np.ndarray
    sd: np.ndarray

    @classmethod
    def of(cls, trial: DecayTrial, fit: DecayFit, robot: RobotSpec) -> "Ring":
        """Build the ring of a decay from its fit and the robot as described.

        Args:
            trial: the decay.
            fit: its fit.
            robot: the robot as described.
        """
        fitted = with_hinges(robot, fit.stiffness_n_m, fit.damping_n_m_s)
        errors = np.array([fit.stiffness_se_n_m, fit.damping_se_n_m_s]) / hinges_of(fitted)
        used = replace(trial, weight=np.where(np.isfinite(fit.measured_m), trial.weight, 0.0))
        return cls(used, fit.start_rad, fitted, np.log(hinges_of(fitted) / hinges_of(robot)), errors)

    @classmethod
    def to_come(cls, name: str, robot: RobotSpec, markers: tuple[str, ...], frame_s: float) -> "Ring":
        """Build the ring of a decay that could be filmed: all hinges of the robot bent equally and let go.

        Args:
            name: name of the decay.
            robot: the robot as described.
            markers: names of the k tail markers.
            frame_s: time between two frames.
        """
        time_s = np.arange(0.0, _LASTS_S, frame_s)
        still, start = np.zeros((len(time_s), len(markers), 2)), np.zeros((2, len(robot.hinges)))
        start[0] = _BENT_RAD
        trial = DecayTrial(name, markers, time_s, still, np.ones(still.shape[:2]), 0, 1.0)
        return cls(trial, start, robot, np.zeros(NUMBERS), np.array(TO_COME_SD))

    @property
    def name(self) -> str:
        """Name of the trial."""
        return self.trial.name

    def of_twin(self, twin: Twin, effects: Sequence[Effect] = (), values: np.ndarray | None = None) -> np.ndarray:
        """Return the numbers (s, 2) of twins with effects, less those of the fitted twin; nan where a twin diverged.

        Their hinges are as much stiffer and more damped than they are described as the robot's were fitted to be.

        Args:
            twin: the plain twin.
            effects: the effects.
            values: (s, p) their values; by default one twin without effects.
        """
        values = np.zeros((1, sum(len(effect.parameters) for effect in effects))) if values is None else values
        robot = with_hinges(twin.robot, *hinges_of(twin.robot) * np.exp(self.residual))
        plain = Twin(robot, twin.markers, self._scene, twin.workers)
        return self._match(self._swings(_ReleasedTwin(plain, effects, self.start_rad), values))

    def _swings(self, released: "_ReleasedTwin", values: np.ndarray) -> np.ndarray:
        """Simulate the motion across the body (s, n, k), m."""
        count, own = len(values), [released.markers.index(name) for name in self.trial.markers]
        runs = AffectedRuns(np.zeros((count, _NO_FLUID)), np.zeros(count), np.zeros(count), values=values)
        return released.simulate(runs, self.trial.time_s, allow_divergence=True).marker_m[:, :, own, 1]

    def _match(self, lateral_m: np.ndarray) -> np.ndarray:
        """Return the numbers (s, 2) of the plain twins nearest to motions (s, n, k), by Gauss-Newton.

        Motions may be of any width. If a motion resembles that of no hinges, they are those at the last step.
        """
        count, seen = len(lateral_m), self._read_samples(lateral_m)
        found, going = np.zeros((count, NUMBERS)), np.arange(count)  # rows whose last step was no short one
        plain, slopes = (np.tile(each, (count, 1, 1)) for each in self._about_fitted)
        for _ in range(_ROUNDS):
            columns = np.concatenate([slopes[going], plain[going]], axis=1)  # (s, 3, i)
            squares = np.linalg.pinv(columns @ np.swapaxes(columns, 1, 2))
            off = columns @ (seen[going] - plain[going, 0])[..., None]
            step = np.clip((squares @ off)[:, :NUMBERS, 0], -_LONGEST, _LONGEST)
            found[going] = np.clip(found[going] + step, -_MOST, _MOST)
            length = np.abs(step).max(axis=1)
            far, near = going[length > _FAR], going[(length <= _FAR) & (length > _SETTLED)]
            going = np.union1d(far, near)
            if not len(going):
                break
            if len(far):
                plain[far], slopes[far] = self._linear(found[far])
            if len(near):
                plain[near, 0] = self._read_samples(self._simulate_plain(found[near]))
        return np.where(np.isfinite(lateral_m).all(axis=(1, 2))[:, None], found, np.nan)

    @cached_property
    def _about_fitted(self) -> tuple[np.ndarray, np.ndarray]:
        """Samples (1, 1, i) and slopes (1, 2, i) of the plain twin with the fitted hinges."""
        return self._linear(np.zeros((1, NUMBERS)))

    def _linear(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return samples (s, 1, i) of plain twins with other hinges, numbers (s, 2) off, and their slopes (s, 2, i)."""
        moved = self._simulate_plain((numbers[:, None] + _SLOPES).reshape(-1, NUMBERS))
        samples = self._read_samples(moved).reshape(len(numbers), 1 + NUMBERS, -1)
        return samples[:, :1], (samples[:, 1:] - samples[:, :1]) / _DIFFERENCE

    def _simulate_plain(self, numbers: np.ndarray) -> np.ndarray:
        """Simulate the motion across the body (s, n, k), m, of plain twins with other hinges.

        Their numbers are off the fitted ones by (s, 2).
        """
        stiffness, damping = (hinges_of(self.robot) * np.exp(numbers)).T
        start = np.tile(self.start_rad, (len(numbers), 1, 1))
        return self._plain(stiffness, damping, start, self.trial.time_s)[..., 1]

    def _read_samples(self, lateral_m: np.ndarray) -> np.ndarray:
        """Return the samples (s, i) that count, less the mean of each marker, as nobody knows where it rests."""
        weight = (self.trial.weight > 0).astype(float)
        mean = (lateral_m * weight).sum(axis=1) / np.maximum(weight.sum(axis=0), 1.0)
        return np.nan_to_num((lateral_m - mean[:, None])[:, weight > 0])

    @property
    def _scene(self) -> Scene:
        """Scene whose step is stable with half the damping too."""
        stiffness, damping = hinges_of(self.robot)
        return stable_scene(damping / stiffness / 2)

    @cached_property
    def _plain(self) -> DecayTwin:
        return DecayTwin(self.robot, self.trial.markers, self._scene, workers=1, extrapolated=False)


def shows_in_decays(effect: Effect) -> bool:
    """Tell whether an effect changes how a released tail rings."""
    return "free_decay" in effect.seen_in and bool(_MOVES & set(effect.enters()))


def ring_changes(ring: Ring, twin: Twin, effects: Sequence[Effect], values: np.ndarray) -> np.ndarray:
    """Return how much effects at values (s, p) change a decay, (s, 2); nan where a twin diverged.

    Only effects that can show in a decay act.

    Args:
        ring: the decay.
        twin: the plain twin.
        effects: the effects.
        values: (s, p) their values.
    """
    act = np.repeat([shows_in_decays(effect) for effect in effects], [len(effect.parameters) for effect in effects])
    own = np.where(act.astype(bool), values, 0.0)
    if not own.any():
        return np.zeros((len(values), NUMBERS))
    found = ring.of_twin(twin, effects, np.vstack([np.zeros_like(own[:1]), own]))
    return np.asarray(found[1:] - found[0])


class _ReleasedTwin(AffectedTwin):
    """A twin that is let go in air, each time equally far from its rest pose and with the same rates (2, h)."""

    def __init__(self, twin: Twin, effects: Sequence[Effect], start_rad: np.ndarray) -> None:
        super().__init__(twin, effects)
        self._start_rad = start_rad

    def start(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, q) and velocities (n, v) of the joints at time 0."""
        position, velocity = super().start(runs)
        models = self._models(np.column_stack([runs.coefficients, self._values(runs)]))
        rests = np.array([model.qpos_spring[self._hinges] for model in models])
        position[:, self._hinges] = self._start_rad[0] + rests - self.model.qpos_spring[self._hinges]
        velocity[:, self._hinges] = self._start_rad[1]
        return position, velocity
