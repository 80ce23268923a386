"""Model of one swim trial, as fit, posterior and forecasts share it.

    y_i = g(theta; f_i) + B_i b_i + delta_i + e_i

theta: the five coefficients, common to all trials. b_i: nuisances that differ from trial to trial (start, boxes,
registration of the head frame, trim). delta_i: model discrepancy, a Gaussian process over frequency with a part common
to all trials and one of each trial. e_i: tracking noise. All but theta enter linearly, so they join one covariance.

`TrialModel` gives g and B of one trial, with the `Roll` of its hull. The discrepancy is in `fitting.covariance`. For
several trials it is faster to ask for all at once (`simulated_together`) than for one after the other: the cores share
their simulations.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from fitting.features import OF_A_MARKER, SPEED, FeatureReader, advance_phase, marker_slice, phase_between
from fitting.noise import FeatureNoise, covariance_of_creeps, noise_of
from fitting.phase import phase_from_harmonic
from fitting.structure import PerturbedTwin
from fitting.trial import MeasuredTrial
from swimcal.effects.water import NATURAL_ROLL_HZ, HullRoll, RollingHull
from swimcal.mjcf import PUBLISHED_COEFFICIENTS
from swimcal.robot import RobotSpec
from swimcal.runs import MarkerKinematics, Runs, Trajectories
from swimcal.twin import Twin, simulate_together

# Roll of the hull
ROLL_SD = np.array([parameter.sd for parameter in HullRoll.parameters])
"""Prior standard deviation of each number, (2,), normal about 0."""
_LOW = np.array([parameter.low for parameter in HullRoll.parameters])
_HIGH = np.array([parameter.high for parameter in HullRoll.parameters])
ROLL_STEP = 0.1
"""Step of finite differences, in standard deviations."""

# One trial
_OF_TRACKS = ("reader", "measured", "noise", "noise_covariance")  # what a roll of the hull does not change
START_PHASE_RAD = 1.0  # crank phase at time 0 of simulations whose crank turns evenly
START_SD = (0.01, 0.02, 0.2)  # sd of the head's velocity at time 0: along, across (m/s), yaw (rad/s)
PHASE_SD_RAD = 0.5  # sd of the crank's phase about the one that puts the tail in step
PLACE_SD_M = 0.05  # sd of the whole fish about its smooth path
LEAST_FREQUENCY_SE = 1e-4  # least relative standard error of a frequency
_THROWN = 10.0  # m, m/s and rad/s; no fish beats or swims beyond these
# Finite differences: of markers, of the velocity at time 0 (m/s, m/s, rad/s) and of the frequency (relative).
_SHIFT_M = 1e-3
_GROWTH = 1e-3  # relative, of the scale
_START_STEP = (0.01, 0.01, 0.1)
_FREQUENCY_STEP = 0.005


# The roll of the hull.


class Roll(NamedTuple):
    """Roll of a hull, as the effect `hull_roll` of the catalogue describes it.

    Attributes:
        per_sway: roll for each metre of sway far above the natural frequency, rad/m; 0 without a roll.
        natural: logarithm of the natural frequency over that of the catalogue.
    """

    per_sway: float = 0.0
    natural: float = 0.0

    @property
    def natural_hz(self) -> float:
        """Natural frequency of the roll, Hz."""
        return NATURAL_ROLL_HZ * float(np.exp(self.natural))

    @property
    def deviance(self) -> float:
        """Half its squared distance from no roll, in standard deviations."""
        return float(0.5 * ((np.array(self) / ROLL_SD) ** 2).sum())

    def moved(self, step: np.ndarray) -> "Roll":
        """Return the roll moved by a step (2,) in standard deviations, within the bounds."""
        return Roll(*map(float, np.clip(np.array(self) + step * ROLL_SD, _LOW, _HIGH)))

    def shifted(self, number: int, sign: int) -> "Roll":
        """Return the roll with one of its numbers off by `ROLL_STEP`."""
        off = np.zeros(2)
        off[number] = sign * ROLL_STEP
        return Roll(*map(float, np.array(self) + off * ROLL_SD))

    def seen(self, motion: Trajectories, robot: RobotSpec, markers: tuple[str, ...]) -> np.ndarray:
        """Return the markers (s, n, m, 2) of simulated trajectories as they swing, m.

        Args:
            motion: the trajectories.
            robot: the robot.
            markers: names of the m markers.
        """
        if not self.per_sway:
            return motion.marker_m
        hull = RollingHull.of(robot, markers)
        axes = MarkerKinematics(robot, markers).axes(motion.head, motion.hinges_rad)
        times = np.broadcast_to(motion.time_s, motion.marker_m.shape[:2])
        found = np.array(motion.marker_m)
        for row in np.flatnonzero(np.isfinite(motion.marker_m).all(axis=(1, 2, 3))):
            swung = hull.shift_m(times[row], motion.marker_m[row], axes[row], motion.crank_rad[row], self.natural_hz)
            found[row] += self.per_sway * swung
        return found


NO_ROLL = Roll()


# One trial.


@dataclass(frozen=True, eq=False)
class TrialModel:
    """One trial and the twin, both as features of length k.

    Attributes:
        twin: the twin, with the trial's markers.
        trial: the trial.
        phase_rad: crank phase that simulations start from, see `starting_phase`; they are then put in step.
        doubted: twins of robots that differ as the robot may.
        with_course: whether features hold how straight the fish goes.
        roll: roll of the hull, with which simulated markers swing.
    """

    twin: Twin
    trial: MeasuredTrial
    phase_rad: float
    doubted: tuple[PerturbedTwin, ...] = ()
    with_course: bool = False
    roll: Roll = NO_ROLL

    @classmethod
    def of(
        cls, twin: Twin, trial: MeasuredTrial, doubted: tuple[PerturbedTwin, ...] = (), with_course: bool = False
    ) -> "TrialModel":
        """Build the model of a trial, with the crank where it was at time 0.

        Args:
            twin: the twin, with the trial's markers.
            trial: the trial.
            doubted: twins of robots that differ as the robot may.
            with_course: whether features hold how straight the fish goes.
        """
        return cls(twin, trial, starting_phase(twin, trial), doubted, with_course)

    def of_other(self, trial: MeasuredTrial) -> "TrialModel":
        """Return the model of another trial of the same robot, with the crank where it was at that trial's time 0."""
        return replace(self, trial=trial, phase_rad=starting_phase(self.twin, trial))

    def rolling(self, roll: Roll) -> "TrialModel":
        """Return the same with another roll; what is known of the measured tracks is not computed anew."""
        found = replace(self, roll=roll)
        found.__dict__.update({name: self.__dict__[name] for name in _OF_TRACKS if name in self.__dict__})
        return found

    @cached_property
    def reader(self) -> FeatureReader:
        """Reader of the trial's features."""
        return FeatureReader.of(self.trial, self.with_course)

    @cached_property
    def measured(self) -> np.ndarray:
        """The measured features, (k,)."""
        return self.reader(self._keep(self.trial.position_m))

    @cached_property
    def noise(self) -> FeatureNoise:
        """Noise of the tracks."""
        return _noise_of(self.trial, self.with_course)

    @cached_property
    def noise_covariance(self) -> np.ndarray:
        """Covariance (k, k) of the measured features."""
        return self.noise.covariance(self.reader)

    @cached_property
    def along_m(self) -> np.ndarray:
        """Places of the markers along the straight robot, (m,) m."""
        return self.twin.robot.marker_positions_m(self.trial.markers)[:, 0]

    def creeps(self, position_m: np.ndarray) -> np.ndarray:
        """Return how fast markers slide aside of their neighbours at positions (..., n, m, 2), (..., m) m/s."""
        return self.reader.creeps(position_m, self.along_m)

    @cached_property
    def measured_creeps(self) -> np.ndarray:
        """The measured `creeps`, (m,) m/s."""
        return self.creeps(self._keep(self.trial.position_m))

    @property
    def judged(self) -> np.ndarray:
        """Return whether each marker has neighbours aside of which it may slide, (m,)."""
        return np.asarray(self.reader.against_neighbours(self.along_m).any(axis=1))

    @cached_property
    def covariance_of_creeps(self) -> np.ndarray:
        """Covariance (m, m) of the measured creeps by the tracking noise, m^2/s^2."""
        return covariance_of_creeps(self.reader, self._keep(self.trial.position_m), self.along_m)

    @property
    def places_of_head(self) -> np.ndarray:
        """Columns of `Sensitivities.boxes` and `markers` that belong to nose and neck, (4,)."""
        return np.ravel([[2 * marker, 2 * marker + 1] for marker in (self.reader.nose, self.reader.neck)])

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the features (s, k) at coefficients (s, 5), in step with the measured tail.

        They are nan where the twin diverged.
        """
        return simulated_together((self,), coefficients)[0]

    def of_sure_robot(self, coefficients: np.ndarray, motion: Trajectories) -> "Sensitivities":
        """Return the sensitivities of the features to each nuisance at coefficients (5,), where the twin moves so.

        The robot has no uncertain numbers here.
        """
        marker_m = self._keep(self._marker_m(motion)[0])  # (n, m, 2)
        features = self.in_step(self.reader(marker_m))
        kinematics = MarkerKinematics(self.twin.robot, self.trial.markers)
        body = self._keep(kinematics.axes(motion.head[0], motion.hinges_rad[0]))  # (n, m, 2, 2)
        pool = np.broadcast_to(np.eye(2), body.shape)
        start, place = self._of_start(coefficients, features), _of_place(len(features))
        own = np.column_stack([*start, PHASE_SD_RAD * slope_of_phase(features), *place])
        boxes = np.column_stack(self._of_shifts(marker_m, pool, features, scaled=False))
        markers = np.column_stack(self._of_shifts(marker_m, body, features, scaled=True))
        larger = (self.in_step(self.reader((1 + _GROWTH) * marker_m)) - features) / _GROWTH
        robot, rolls = np.zeros((len(features), 0)), self.slopes_of_roll(motion)
        return Sensitivities(own, boxes, markers, robot, rolls, larger[:, None], self._spans(marker_m, pool))

    def _of_start(self, coefficients: np.ndarray, features: np.ndarray) -> np.ndarray:
        """Return the effect (4, k) of the velocity at time 0 and of the frequency, about features (k,)."""
        frequency = self.trial.frequency
        relative = max(frequency.se_hz / frequency.hz, LEAST_FREQUENCY_SE) if np.isfinite(frequency.se_hz) else 0.01
        step = np.array([*_START_STEP, _FREQUENCY_STEP])
        steps = np.vstack([np.diag(step), -np.diag(step)])  # (8, 4)
        runs = self.runs(np.tile(coefficients, (len(steps), 1)), 1 + steps[:, 3], steps[:, :3])
        marker_m = self._marker_m(self.twin.simulate(runs, self.time_s, allow_divergence=True))
        up, down = np.split(self.in_step(self.reader(self._keep(marker_m))), 2)
        moved = (np.array([*START_SD, relative]) / (2 * step))[:, None] * difference(up, down, features)
        # Near a second steady state slopes are steep, but the start moves the mean speed by no more than its own error.
        of_velocity = moved[: len(START_SD)]
        of_velocity *= min(1.0, START_SD[0] / max(float(np.linalg.norm(of_velocity[:, SPEED])), 1e-12))
        return moved

    def _of_shifts(
        self, marker_m: np.ndarray, axes: np.ndarray, features: np.ndarray, scaled: bool
    ) -> list[np.ndarray]:
        """Return the derivative of the features by each marker's shift along each of its axes (n, m, 2, 2), 1/m.

        Scaled, the distance between nose and neck gives the scale, so a shift of either scales all.
        """
        slopes, nose, neck = [], self.reader.nose, self.reader.neck
        length = self._head_length(marker_m)
        for marker in range(marker_m.shape[1]):
            for axis in range(2):
                shifted = np.array(marker_m)
                shifted[:, marker] += _SHIFT_M * axes[:, marker, axis]
                if scaled and marker in (nose, neck):
                    shifted *= length / self._head_length(shifted)
                slopes.append((self.in_step(self.reader(shifted)) - features) / _SHIFT_M)
        return slopes

    def _spans(self, marker_m: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Return the derivative (2 m,) of the logarithm of the scale by each marker's shift along its axes, 1/m."""
        found = np.zeros(2 * marker_m.shape[1])
        for place in self.places_of_head:
            shifted = np.array(marker_m)
            shifted[:, place // 2] += _SHIFT_M * axes[:, place // 2, place % 2]
            found[place] = -np.log(self._head_length(shifted) / self._head_length(marker_m)) / _SHIFT_M
        return found

    def _head_length(self, marker_m: np.ndarray) -> float:
        """Return the mean distance from nose to neck of markers (n, m, 2), m."""
        return float(np.linalg.norm(marker_m[:, self.reader.nose] - marker_m[:, self.reader.neck], axis=-1).mean())

    def slopes_of_roll(self, motion: Trajectories) -> np.ndarray:
        """Return the change (k, 2) of the features with one prior standard deviation of each number of the roll."""
        either = [[self.roll.shifted(number, sign) for sign in (1, -1)] for number in range(len(self.roll))]
        rows = [[self.rolling(roll).features_of(motion)[0] for roll in pair] for pair in either]
        return np.column_stack([(up - down) / (2 * ROLL_STEP) for up, down in rows])

    def in_step(self, features: np.ndarray) -> np.ndarray:
        """Return features (..., k) with their tails in step with the measured one."""
        return advance_phase(features, phase_between(features, self.measured, list(self.trial.tail)))

    def positions(self, coefficients: np.ndarray) -> np.ndarray:
        """Simulate the markers (s, n, m, 2) at coefficients (s, 5) in the kept frames, in the twin's own frame, m."""
        return self.positions_in(self.trajectories(coefficients))

    def positions_in(self, motion: Trajectories) -> np.ndarray:
        """Return the markers (s, n, m, 2) of trajectories in the kept frames, in the twin's own frame, m."""
        return self._keep(self._marker_m(motion))

    def trajectories(self, coefficients: np.ndarray) -> Trajectories:
        """Simulate the trial at coefficients (s, 5)."""
        return self.twin.simulate(self.runs(coefficients), self.time_s, allow_divergence=True)

    @property
    def time_s(self) -> np.ndarray:
        """Times (n,) of the frames up to the last that is kept."""
        return self.trial.time_s[: int(np.flatnonzero(self.trial.kept)[-1]) + 1]

    def runs(self, coefficients: np.ndarray, faster: np.ndarray | None = None, shift: np.ndarray | None = None) -> Runs:
        """Return runs of the trial.

        Args:
            coefficients: (s, 5).
            faster: (s,) factors on the frequency of the crank.
            shift: (s, 3) shifts of the velocity at time 0.
        """
        count, trial, turn = len(coefficients), self.trial, self.trial.turn
        faster = np.ones(count) if faster is None else faster
        turned = {} if turn is None else {by: turn.shifted(0.0, by) for by in set(map(float, faster))}
        return Runs(
            coefficients=np.ascontiguousarray(coefficients),
            frequency_hz=faster * trial.frequency.hz,
            phase_rad=np.full(count, self.phase_rad),
            velocity=np.tile(trial.start_velocity, (count, 1)) + (0.0 if shift is None else shift),
            turns=tuple(turned[float(by)] for by in faster) if turned else None,
        )

    def features_of(self, motion: Trajectories) -> np.ndarray:
        """Return the features (s, k) of trajectories up to the last frame that is kept, in step with the measured tail.

        Features of a twin that is thrown about, as before it diverges, are nan as well.
        """
        found = self.in_step(self.reader(self.positions_in(motion)))
        with np.errstate(invalid="ignore"):
            stands = (np.abs(found) < _THROWN).all(axis=-1, keepdims=True)
        return np.where(stands, found, np.nan)

    def _marker_m(self, motion: Trajectories) -> np.ndarray:
        """Return the markers (s, n, m, 2) with the roll, m."""
        return self.roll.seen(motion, self.twin.robot, self.trial.markers)

    def _keep(self, series: np.ndarray) -> np.ndarray:
        """Return the kept frames of positions (n, m, 2) or (s, n, m, 2), or of axes (n, m, 2, 2)."""
        axis = 1 if series.ndim == 4 and series.shape[-2:] != (2, 2) else 0
        return np.compress(self.trial.kept[: series.shape[axis]], series, axis=axis)


def starting_phase(twin: Twin, trial: MeasuredTrial) -> float:
    """Return the crank phase at time 0 that simulations of a trial start from, rad.

    A crank that turns evenly may start anywhere, as features are put in step afterwards. A measured turn is faster here
    and slower there in each beat: it must begin where the crank was, which the tail tells, but for some hundredths of a
    beat by which the lag of the tail differs from that with the published coefficients.

    Args:
        twin: the twin, with the trial's markers.
        trial: the trial.
    """
    if trial.turn is None:
        return START_PHASE_RAD
    with np.errstate(invalid="ignore"):
        found = float(phase_from_harmonic(twin, trial, np.array([PUBLISHED_COEFFICIENTS]), trial.start_frequency.hz)[0])
    return found if np.isfinite(found) else START_PHASE_RAD


@lru_cache(maxsize=32)
def _noise_of(trial: MeasuredTrial, with_course: bool) -> FeatureNoise:
    """Estimate the noise of a trial's tracks, once for fit, posterior and diagnosis."""
    return noise_of(FeatureReader.of(trial, with_course), trial.position_m[trial.kept])


class Sensitivities(NamedTuple):
    """Sensitivities of features to nuisances, as columns (k, q).

    Nuisances of the trial: velocity at time 0, frequency, phase, and where the fish is; and, by the metre, where each
    box sits on its marker, in a picture of known scale. Nuisances of the session: by the metre, where each marker sits
    on the body (with the scale that goes with nose and neck); and the robot's uncertain numbers. The scale of the
    picture goes with the boxes of nose and neck of one trial or of several: see `fitting.picture_scale.box_columns`.

    Attributes:
        own: those of the trial, by their standard deviations.
        boxes, markers: boxes 1 m off their markers, and markers 1 m off their places on the body.
        robot: the robot's uncertain numbers, by their standard deviations.
        rolls: the two numbers of the hull's roll, by their standard deviations.
        scale: the logarithm of the picture's scale, (k, 1).
        spans: (2 m,) derivative of that logarithm by boxes 1 m off; 0 but for nose and neck.
    """

    own: np.ndarray
    boxes: np.ndarray
    markers: np.ndarray
    robot: np.ndarray
    rolls: np.ndarray
    scale: np.ndarray
    spans: np.ndarray


def simulated_together(models: Sequence[TrialModel], coefficients: np.ndarray) -> list[np.ndarray]:
    """Simulate the features (s, k) of each of several trials; those with the same twin run at once.

    Args:
        models: the trials.
        coefficients: (s, 5).
    """
    motion = trajectories_together(models, coefficients)
    return [model.features_of(each) for model, each in zip(models, motion, strict=True)]


def trajectories_together(models: Sequence[TrialModel], coefficients: np.ndarray) -> list[Trajectories]:
    """Simulate each of several trials; those with the same twin run at once.

    Args:
        models: the trials.
        coefficients: (s, 5).
    """
    runs, times = [model.runs(coefficients) for model in models], [model.time_s for model in models]
    return simulate_together([model.twin for model in models], runs, times)


def sensitivities_together(
    models: Sequence[TrialModel], coefficients: np.ndarray, motions: Sequence[Trajectories] | None = None
) -> list[Sensitivities]:
    """Return the sensitivities of several trials to each nuisance.

    Args:
        models: the trials, whose robots have the same uncertain numbers.
        coefficients: (5,) where.
        motions: what swims there, in each trial; default: it is simulated.
    """
    at = coefficients[None]
    motions = trajectories_together(models, at) if motions is None else motions
    columns: list[list[tuple[float, np.ndarray, np.ndarray]]] = [[] for _ in models]
    for doubts in zip(*(model.doubted for model in models), strict=True):
        more, less = (
            simulated_together([replace(model, twin=twin) for model, twin in zip(models, twins, strict=True)], at)
            for twins in ([doubt.more for doubt in doubts], [doubt.less for doubt in doubts])
        )
        for own, doubt, up, down in zip(columns, doubts, more, less, strict=True):
            own.append((doubt.per_sd, up[0], down[0]))
    found = [model.of_sure_robot(coefficients, motion) for model, motion in zip(models, motions, strict=True)]
    middles = [model.features_of(motion) for model, motion in zip(models, motions, strict=True)]
    return [
        each._replace(
            robot=np.column_stack([each.robot, *(sd * difference(up, down, middle[0]) for sd, up, down in own)])
        )
        for each, own, middle in zip(found, columns, middles, strict=True)
    ]


def difference(up: np.ndarray, down: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return features (..., k) one step up less those one step down.

    Where the twin diverged on one side it is twice the difference to the middle, where on both sides 0.

    Args:
        up: (..., k) one step up.
        down: (..., k) one step down.
        middle: (k,) without a step.
    """
    up, down = (np.where(np.isfinite(each).all(axis=-1, keepdims=True), each, np.nan) for each in (up, down))
    up, down = np.where(np.isnan(up), 2 * middle - down, up), np.where(np.isnan(down), 2 * middle - up, down)
    return np.nan_to_num(up - down)


def slope_of_phase(features: np.ndarray) -> np.ndarray:
    """Return the derivative of features (..., k) by the phase of the crank, 1/rad."""
    step = 1e-4
    return (advance_phase(features, step) - advance_phase(features, -step)) / (2 * step)


def _of_place(length: int) -> list[np.ndarray]:
    """Return the columns that move the mean of all markers, along and across."""
    columns = []
    for axis in range(2):
        column = np.zeros(length)
        column[marker_slice(length)].reshape(-1, 2, OF_A_MARKER)[:, axis, 0] = PLACE_SD_M
        columns.append(column)
    return columns
