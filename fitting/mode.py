"""Model of a session, and the mode of the posterior density of its coefficients.

`SessionModel` stacks the models of the trials (`fitting.trial_model`) to one row, with a `NuisanceModel` of what
differs between them and of their noise. `Mode` holds coefficients, variance components and covariance, with the normal
approximation about them; `mode_at` makes one of coefficients that are known, and `fitting.search` finds the most
probable one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve

from fitting.covariance import COEFFICIENT_SD, FORECAST_SPEED, Block, Covariance
from fitting.decay_fit import NUMBERS as RING_NUMBERS
from fitting.decay_fit import Ring
from fitting.features import beat_phase
from fitting.phase import swims_forward
from fitting.structure import ParameterUncertainty, assumed, perturbed_twins, uncertainties_of
from fitting.trial import MeasuredTrial
from fitting.trial_model import (
    NO_ROLL,
    START_PHASE_RAD,
    Roll,
    TrialModel,
    difference,
    sensitivities_together,
    simulated_together,
)
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.twin import Twin

# The mode
_ROOT_STEP = 0.08  # finite difference in roots of coefficients: Kutta lift roughens the twin below that
_ENDS_APART = 1.0  # root mean square distance, in standard deviations, from which two ends differ
_AS_LIKELY = 2.0  # log density within which two ends are as likely


class PlacementUncertainty(NamedTuple):
    """Standard deviations, m: of boxes from markers, anew in each trial; of markers on the body, the same in all."""

    box_m: float
    marker_m: float


class NuisanceModel(NamedTuple):
    """Nuisance model of features of length k: noise, and columns by which each nuisance moves them.

    Attributes:
        noise: (k, k) covariance.
        own: (k, p) of the nuisances that each trial has to itself, but boxes.
        per_box: (k, b) of boxes 1 m off their markers.
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
        return cls(tuple(TrialModel(twin, trial, START_PHASE_RAD, doubted, with_course) for trial in trials))

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
        """Number of entries after the features that a diagnosis reads: frequencies, then `Ring.residual` by decay."""
        return self.frequencies + self.of_rings

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
    def ring_residuals(self) -> np.ndarray:
        """Residuals (r,) of the decays, as fitted less as described: no coefficient matters in air."""
        return np.concatenate([np.zeros(0), *(ring.residual for ring in self.rings)])

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

    @property
    def rings_sd(self) -> np.ndarray:
        """Standard deviations (r,) of the decays by tracking noise."""
        return np.concatenate([np.zeros(0), *(ring.sd for ring in self.rings)])

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
        boxes = block_diag(*[each.boxes for each in sensitivities])
        markers, robot = (np.vstack([getattr(e, name) for e in sensitivities]) for name in ("markers", "robot"))
        return NuisanceModel(self.noise if noise is None else noise, own, boxes, markers, robot)


# The mode, and the normal approximation about it.


class SearchEnd(NamedTuple):
    """End of one start of the search.

    Attributes:
        start, coefficients: (5,) before and after.
        log_density: ln of the marginal posterior of the variance components, coefficients integrated out.
        converged: the last step was short.
        forward: started from rest, the twin swims forward.
    """

    start: np.ndarray
    coefficients: np.ndarray
    log_density: float
    converged: bool
    forward: bool


@dataclass(frozen=True, eq=False)
class Mode:
    """The likeliest coefficients, and the normal approximation about them (Laplace).

    Attributes:
        model: the trials it rests on, with the likeliest roll of the hull.
        coefficients: (5,).
        sizes: standard deviation of each variance component, by its name.
        covariance: covariance of the features.
        blocks: blocks of the trials, in the order of the row.
        residual: (K,) measured less simulated.
        jacobian: (K, 5) of the simulated features.
        ends: ends of all starts, the best first.
        simulations: how often the trials were simulated.
    """

    model: SessionModel
    coefficients: np.ndarray
    sizes: Mapping[str, float]
    covariance: Covariance
    blocks: tuple[Block, ...]
    residual: np.ndarray
    jacobian: np.ndarray
    ends: tuple[SearchEnd, ...]
    simulations: int

    @property
    def roll(self) -> Roll:
        """Likeliest roll of the hull; its uncertainty is part of the covariance."""
        return self.model.trials[0].roll

    @property
    def total(self) -> np.ndarray:
        """Covariance (K, K) of the residual."""
        return self.covariance.at(self.sizes)

    @property
    def forecast_sizes(self) -> Mapping[str, float]:
        """Standard deviation of each component in forecasts."""
        return {**self.sizes, "speed_common": FORECAST_SPEED}

    @property
    def coefficient_covariance(self) -> np.ndarray:
        """Covariance (5, 5) of the coefficients, by the curvature and the width of their prior."""
        return coefficient_covariance(self.total, self.jacobian)

    def simulated(self, number: int) -> np.ndarray:
        """Return the features (k,) of the twin in a fitted trial."""
        length = len(self.blocks[number].model.measured)
        return self.blocks[number].model.measured - self.residual[number * length :][:length]

    @property
    def disagree(self) -> tuple[SearchEnd, ...]:
        """Ends as likely as the best, but at other coefficients."""
        sd = np.sqrt(np.diag(self.coefficient_covariance))
        best = self.ends[0]

        def apart(end: SearchEnd) -> bool:
            return bool(np.sqrt(np.mean(((end.coefficients - best.coefficients) / sd) ** 2)) > _ENDS_APART)

        return tuple(
            end
            for end in self.ends[1:]
            if end.forward == best.forward and end.log_density > best.log_density - _AS_LIKELY and apart(end)
        )


def mode_at(
    model: SessionModel,
    coefficients: np.ndarray,
    sizes: Mapping[str, float],
    roll: Roll = NO_ROLL,
    ends: tuple[SearchEnd, ...] = (),
) -> Mode:
    """Return the normal approximation about known coefficients, with variance components of known sizes.

    Args:
        model: the trials.
        coefficients: (5,).
        sizes: standard deviation of each variance component, by its name.
        roll: roll of the hull.
        ends: ends of the search, the best first.
    """
    model = model.rolling(roll)
    blocks = blocks_at(model, coefficients)
    residual = model.measured - model.simulated(coefficients[None])[0]
    jacobian = jacobian_at(model.trials, coefficients)
    covariance = Covariance.of(blocks)
    return Mode(model, coefficients, sizes, covariance, blocks, residual, jacobian, ends, simulations=0)


def blocks_at(model: SessionModel, coefficients: np.ndarray) -> tuple[Block, ...]:
    """Return the blocks of the fitted trials, with their sensitivities at coefficients (5,)."""
    sensitivities = sensitivities_together(model.trials, coefficients)
    trials = zip(model.trials, sensitivities, time_step_errors(model.trials, coefficients), strict=True)
    return tuple(
        Block(each, own, each.noise_covariance, time_step, number, each.measured)
        for number, (each, own, time_step) in enumerate(trials)
    )


def jacobian_at(trials: Sequence[TrialModel], coefficients: np.ndarray) -> np.ndarray:
    """Return the Jacobian (K, 5) of the simulated features by central differences within the bounds.

    Args:
        trials: the trials.
        coefficients: (5,) where.
    """
    steps = 2 * _ROOT_STEP * np.sqrt(np.maximum(coefficients, 0.01))
    up, down = (np.clip(coefficients + sign * np.diag(steps), *COEFFICIENT_BOUNDS) for sign in (1, -1))
    rows = np.hstack(simulated_together(trials, np.vstack([up, down])))
    middle = rows[0]
    if not np.isfinite(rows).all():
        middle = np.hstack(simulated_together(trials, coefficients[None]))[0]
    return np.asarray((difference(rows[:5], rows[5:], middle) / np.diag(up - down)[:, None]).T)


def time_step_errors(trials: Sequence[TrialModel], coefficients: np.ndarray) -> list[np.ndarray]:
    """Return, for each trial, what simulated features (k,) lack against a vanishing time step, at coefficients (5,).

    It is twice the change from whole to half steps, as the integrator is of first order (Richardson 1911). The
    coefficients belong to the twin as it is stepped, so that a calibrated model swims as it was fitted; the error
    widens intervals.
    """
    twin = trials[0].twin
    finer = twin.at_step(twin.scene.timestep_s / 2)
    whole, half = (
        simulated_together(each, coefficients[None])
        for each in (trials, [replace(trial, twin=finer) for trial in trials])
    )
    return [2 * np.nan_to_num(after[0] - before[0]) for before, after in zip(whole, half, strict=True)]


def coefficient_covariance(total: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """Return the covariance (5, 5) of the coefficients.

    Args:
        total: (K, K) covariance of the features.
        jacobian: (K, 5) of the features by the coefficients.
    """
    information = jacobian.T @ cho_solve(cho_factor(total, lower=True), jacobian)
    return np.linalg.inv(information + COEFFICIENT_SD**-2.0 * np.eye(jacobian.shape[1]))


def broyden(slopes: np.ndarray, step: np.ndarray, change: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Update a Jacobian so that it reproduces the change of a step, with the least other change (Broyden 1965).

    Args:
        slopes: (k, p) Jacobian.
        step: (p,) the step.
        change: (k,) what it did.
        along: (p,) the step times the matrix by which lengths of steps are measured.
    """
    return np.asarray(slopes + np.outer(change - slopes @ step, along) / (along @ step))
