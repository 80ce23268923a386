"""All trials of a session at once: their features in one row, and the covariance of what is known to disturb them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from fitting.forecast import swims_forward
from fitting.free_decay.ring import NUMBERS as RING_NUMBERS
from fitting.free_decay.ring import Ring
from fitting.model.features import beat_phase
from fitting.model.roll import Roll
from fitting.model.trial_model import TrialModel, sensitivities_together, simulated_together
from fitting.structure import ParameterUncertainty, assumed, perturbed_twins, uncertainties_of
from fitting.trial import MeasuredTrial
from swimmer import Twin

START_PHASE_RAD = 1.0  # of the crank in simulations; features are put in step afterwards


class PlacementUncertainty(NamedTuple):
    """Standard deviations, m: of boxes from markers, anew in each trial; of markers on the body, the same in all."""

    box_m: float
    marker_m: float


class NuisanceModel(NamedTuple):
    """Of features of length k: noise, and columns by which a standard deviation of each nuisance moves them.

    Attributes:
        noise: (k, k) covariance.
        own: (k, p) of the nuisances that each trial has to itself, but boxes.
        per_box: (k, b) of boxes 1 m off their markers.
        per_marker: (k, 2 m) of markers 1 m off their places on the body, the same in all trials.
        robot: (k, q) of what is doubted of it, the same in all trials.
    """

    noise: np.ndarray
    own: np.ndarray
    per_box: np.ndarray
    per_marker: np.ndarray
    robot: np.ndarray

    @property
    def finite(self) -> bool:
        """Whether no twin diverged."""
        return all(bool(np.isfinite(part).all()) for part in self)

    @property
    def fixed(self) -> np.ndarray:
        """(k, k) covariance of noise and of all nuisances but boxes and markers."""
        return np.asarray(self.noise + self.own @ self.own.T + self.robot @ self.robot.T)

    def of(self, off: "PlacementUncertainty") -> np.ndarray:
        """(k, k) with boxes and markers that far off."""
        boxes, markers = off.box_m * self.per_box, off.marker_m * self.per_marker
        return np.asarray(self.fixed + boxes @ boxes.T + markers @ markers.T)


@dataclass(frozen=True, eq=False)
class SessionModel:
    """The trials a posterior rests on; features of all of them stand in one row of length k.

    Attributes:
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
        """Of measured trials, with what is doubted of the robot; by default, that nobody measured it."""
        doubts = uncertainties_of(assumed(twin.robot).sources) if doubts is None else doubts
        doubted = perturbed_twins(twin, doubts)
        return cls(tuple(TrialModel(twin, trial, START_PHASE_RAD, doubted, with_course) for trial in trials))

    def rolling(self, roll: Roll) -> "SessionModel":
        """The same with another roll of the hull."""
        return replace(self, trials=tuple(trial.rolling(roll) for trial in self.trials))

    @property
    def logged(self) -> tuple[int, ...]:
        """Numbers of the trials whose motor was logged while it was given a known speed."""
        trials = enumerate(each.trial for each in self.trials)
        return tuple(i for i, trial in trials if trial.commanded_hz is not None and trial.logged_hz is not None)

    @property
    def frequencies(self) -> int:
        """How many of them these trials tell: of each trial that of its tail, and of the logged ones the motor's."""
        return len(self.trials) + len(self.logged)

    @property
    def beside(self) -> int:
        """How many numbers a diagnosis reads after the features: frequencies, then `Ring.residual` of each decay."""
        return self.frequencies + self.of_rings

    @property
    def of_rings(self) -> int:
        """How many of them decays tell."""
        return RING_NUMBERS * len(self.rings)

    @property
    def places_of_rings(self) -> slice:
        """Where a row holds these: at its end."""
        end = len(self.measured) + self.beside
        return slice(end - self.of_rings, end)

    @cached_property
    def ring_residuals(self) -> np.ndarray:
        """(r,) of the decays, as fitted less as described: no coefficient matters in air."""
        return np.concatenate([np.zeros(0), *(ring.residual for ring in self.rings)])

    @cached_property
    def ring_sensitivities(self) -> np.ndarray:
        """(r, q) of the decays what is doubted of the robot, by its standard deviations, as of the features."""
        if not self.rings:
            return np.zeros((0, len(self.trials[0].doubted)))
        measured = [
            [each.per_sd * (ring.of_twin(each.more)[0] - ring.of_twin(each.less)[0]) for ring in self.rings]
            for each in self.trials[0].doubted
        ]
        return np.reshape(measured, (len(measured), self.of_rings)).T

    @property
    def rings_sd(self) -> np.ndarray:
        """(r,) of the decays by tracking noise."""
        return np.concatenate([np.zeros(0), *(ring.sd for ring in self.rings)])

    @cached_property
    def phase_rad(self) -> np.ndarray:
        """(t,) of the beat of each tail at time 0, see `beat_phase`: what is alike in trials is so at one phase."""
        return np.array([float(beat_phase(model.measured, list(model.trial.tail))) for model in self.trials])

    @cached_property
    def measured(self) -> np.ndarray:
        """(k,) the measured row."""
        return np.concatenate([model.measured for model in self.trials])

    @property
    def observed(self) -> np.ndarray:
        """(k,) numbers of the row that its tracks tell; the others are 0, measured and simulated."""
        return np.concatenate([model.reader.observed for model in self.trials])

    @cached_property
    def noise(self) -> np.ndarray:
        """(k, k) covariance of the tracking noise."""
        return block_diag(*[model.noise_covariance for model in self.trials])

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        """(s, k) rows of coefficients (s, 5); nan where the twin diverged."""
        return np.hstack(simulated_together(self.trials, coefficients))

    def swim_forward(self, coefficients: np.ndarray) -> np.ndarray:
        """(s,) whether the twins of coefficients (s, 5) swim forward from rest."""
        return swims_forward(self.trials[0].twin, coefficients, tuple(each.trial for each in self.trials))

    def disturbances(self, coefficients: np.ndarray, noise: np.ndarray | None = None) -> NuisanceModel:
        """What noise and nuisances do at coefficients (5,); noise (k, k) by default as the tracks show it."""
        sensitivities = sensitivities_together(self.trials, coefficients)
        own = block_diag(*[each.own for each in sensitivities])
        boxes = block_diag(*[each.boxes for each in sensitivities])
        markers, robot = (
            np.vstack(each) for each in zip(*[(each.markers, each.robot) for each in sensitivities], strict=True)
        )
        return NuisanceModel(self.noise if noise is None else noise, own, boxes, markers, robot)
