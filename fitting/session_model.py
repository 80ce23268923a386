"""Model of a session: its trials stacked to one row, with what they have in common.

`SessionModel` stacks the models of the trials (`fitting.trial_model`), with a `NuisanceModel` of what differs between
them and of their noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from fitting.decay_fit import NUMBERS as RING_NUMBERS
from fitting.features import beat_phase
from fitting.phase import swims_forward
from fitting.picture_scale import box_columns
from fitting.ring import Ring
from fitting.structure import ParameterUncertainty, assumed, perturbed_twins, uncertainties_of
from fitting.trial import MeasuredTrial
from fitting.trial_model import Roll, TrialModel, sensitivities_together, simulated_together
from swimcal.twin import Twin


class PlacementUncertainty(NamedTuple):
    """Standard deviations, m: of boxes from markers, anew in each trial; of markers on the body, the same in all."""

    box_m: float
    marker_m: float


class NuisanceModel(NamedTuple):
    """Nuisance model of features of length k: noise, and columns by which each nuisance moves them.

    Attributes:
        noise: (k, k) covariance.
        own: (k, p) of the nuisances that each trial has to itself, but boxes.
        per_box: (k, b) of boxes 1 m off their markers, by `fitting.picture_scale.box_columns`.
        per_marker: (k, 2 m) of markers 1 m off their places on the body, the same in all trials.
        robot: (k, q) of the robot's uncertain numbers, the same in all trials.
    """

    noise: np.ndarray
    own: np.ndarray
    per_box: np.ndarray
    per_marker: np.ndarray
    robot: np.ndarray

    @property
    def finite(self) -> bool:
        """Return whether no twin diverged."""
        return all(bool(np.isfinite(part).all()) for part in self)

    @property
    def fixed(self) -> np.ndarray:
        """Covariance (k, k) of noise and of all nuisances but boxes and markers."""
        return np.asarray(self.noise + self.own @ self.own.T + self.robot @ self.robot.T)

    def of(self, off: "PlacementUncertainty") -> np.ndarray:
        """Return the covariance (k, k) with boxes and markers that far off."""
        boxes, markers = off.box_m * self.per_box, off.marker_m * self.per_marker
        return np.asarray(self.fixed + boxes @ boxes.T + markers @ markers.T)


@dataclass(frozen=True, eq=False)
class SessionModel:
    """The trials that a posterior rests on; the features of all of them form one row of length k.

    Attributes:
        trials: the trials.
        rings: free decays of the same robot, of which a diagnosis reads more numbers.
    """

    trials: tuple[TrialModel, ...]
    rings: tuple[Ring, ...] = ()

    @classmethod
    def of(
        cls,
        twin: Twin,
        trials: Sequence[MeasuredTrial],
        doubts: Sequence[ParameterUncertainty] | None = None,
        with_course: bool = False,
    ) -> "SessionModel":
        """Build the model of measured trials.

        Args:
            twin: the twin.
            trials: the trials.
            doubts: uncertain numbers of the robot; by default all, as if nobody measured it.
            with_course: whether features hold the course.
        """
        doubts = uncertainties_of(assumed(twin.robot).sources) if doubts is None else doubts
        doubted = perturbed_twins(twin, doubts)
        return cls(tuple(TrialModel.of(twin, trial, doubted, with_course) for trial in trials))

    def rolling(self, roll: Roll) -> "SessionModel":
        """Return the same with another roll of the hull."""
        return replace(self, trials=tuple(trial.rolling(roll) for trial in self.trials))

    @property
    def logged(self) -> tuple[int, ...]:
        """Numbers of the trials whose motor was logged while it was given a known speed."""
        trials = enumerate(each.trial for each in self.trials)
        return tuple(i for i, trial in trials if trial.commanded_hz is not None and trial.logged_hz is not None)

    @property
    def frequencies(self) -> int:
        """Number of frequencies in the row: that of each trial's tail, and of the logged ones the motor's."""
        return len(self.trials) + len(self.logged)

    @property
    def beside(self) -> int:
        """Number of entries after the features that a diagnosis reads: frequencies, creeps, and `Ring.residual`."""
        return self.frequencies + self.of_creeps + self.of_rings

    @property
    def of_creeps(self) -> int:
        """Number of markers' speeds aside in the row, one a marker and trial; 0 without the course."""
        return sum(len(each.trial.markers) for each in self.trials if each.with_course)

    @property
    def places_of_creeps(self) -> slice:
        """Place of the markers' speeds aside in a row: after the frequencies."""
        first = len(self.measured) + self.frequencies
        return slice(first, first + self.of_creeps)

    @property
    def creeps_observed(self) -> np.ndarray:
        """Return whether each marker's speed aside is measured, (c,); the others are 0."""
        return np.concatenate([np.zeros(0, bool), *(each.judged for each in self.trials if each.with_course)])

    @property
    def measured_creeps(self) -> np.ndarray:
        """Speeds at which markers slide aside of their neighbours, trial by trial, (c,) m/s; a twin's do not."""
        return np.concatenate([np.zeros(0), *(each.measured_creeps for each in self.trials if each.with_course)])

    @cached_property
    def covariance_of_creeps(self) -> np.ndarray:
        """Covariance (c, c) of the markers' speeds aside by the tracking noise, m^2/s^2."""
        found = [each.covariance_of_creeps for each in self.trials if each.with_course]
        return np.asarray(block_diag(*found)) if found else np.zeros((0, 0))

    @property
    def of_rings(self) -> int:
        """Number of those that free decays give."""
        return RING_NUMBERS * len(self.rings)

    @property
    def places_of_rings(self) -> slice:
        """Place of those that free decays give in a row: at its end."""
        end = len(self.measured) + self.beside
        return slice(end - self.of_rings, end)

    @cached_property
    def ring_sensitivities(self) -> np.ndarray:
        """Sensitivities (r, q) of the decays to the robot's uncertain numbers, by their standard deviations."""
        if not self.rings:
            return np.zeros((0, len(self.trials[0].doubted)))
        measured = [
            [each.per_sd * (ring.of_twin(each.more)[0] - ring.of_twin(each.less)[0]) for ring in self.rings]
            for each in self.trials[0].doubted
        ]
        return np.reshape(measured, (len(measured), self.of_rings)).T

    @cached_property
    def phase_rad(self) -> np.ndarray:
        """Phase of the beat of each tail at time 0, (t,), see `beat_phase`: what trials share is so at one phase."""
        return np.array([float(beat_phase(model.measured, list(model.trial.tail))) for model in self.trials])

    @cached_property
    def measured(self) -> np.ndarray:
        """The measured row, (k,)."""
        return np.concatenate([model.measured for model in self.trials])

    @property
    def observed(self) -> np.ndarray:
        """Return whether the tracks tell each number of the row, (k,); the others are 0, measured and simulated."""
        return np.concatenate([model.reader.observed for model in self.trials])

    @cached_property
    def noise(self) -> np.ndarray:
        """Covariance (k, k) of the tracking noise."""
        return block_diag(*[model.noise_covariance for model in self.trials])

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the rows (s, k) at coefficients (s, 5); nan where the twin diverged."""
        return np.hstack(simulated_together(self.trials, coefficients))

    def swim_forward(self, coefficients: np.ndarray) -> np.ndarray:
        """Tell whether the twins of coefficients (s, 5) swim forward from rest, (s,)."""
        return swims_forward(self.trials[0].twin, coefficients, tuple(each.trial for each in self.trials))

    def disturbances(self, coefficients: np.ndarray, noise: np.ndarray | None = None) -> NuisanceModel:
        """Return the nuisance model at coefficients (5,); the noise (k, k) is by default that of the tracks."""
        sensitivities = sensitivities_together(self.trials, coefficients)
        own = block_diag(*[each.own for each in sensitivities])
        boxes = box_columns(self.trials, sensitivities)
        markers, robot = (
            np.vstack(each) for each in zip(*[(each.markers, each.robot) for each in sensitivities], strict=True)
        )
        return NuisanceModel(self.noise if noise is None else noise, own, boxes, markers, robot)
