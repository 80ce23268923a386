"""Mode of the posterior density of a session's coefficients, with the normal approximation about it.

`Mode` holds coefficients, variance components and covariance; `mode_at` makes one of coefficients that are known, and
`fitting.search` finds the most probable one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from fitting.covariance import COEFFICIENT_SD, FORECAST_SPEED, Block, Covariance
from fitting.session_model import SessionModel
from fitting.trial_model import (
    NO_ROLL,
    Roll,
    TrialModel,
    difference,
    sensitivities_together,
    simulated_together,
    trajectories_together,
)
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.runs import Trajectories

# The mode
_ROOT_STEP = 0.08  # finite difference in roots of coefficients: Kutta lift roughens the twin below that
_ENDS_APART = 1.0  # root mean square distance, in standard deviations, from which two ends differ
FINER = 8
"""Fine steps in one step of the twin: what they change tells the error of the step."""
AS_LIKELY = 2.0
"""Log density within which two ends are as likely."""


# The mode, and the normal approximation about it.


class SearchEnd(NamedTuple):
    """End of one start of the search.

    Attributes:
        start, coefficients: (5,) before and after.
        log_density: ln of the posterior density at these coefficients, but for a constant: that of the variance
            components with the coefficients integrated out, less half the squares that a free step would remove.
        converged: the last step was short.
        forward: started from rest, the twin swims forward.
        refused: clearly likelier coefficients next to it were refused, as their twin does not.
    """

    start: np.ndarray
    coefficients: np.ndarray
    log_density: float
    converged: bool
    forward: bool
    refused: bool = False


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
        spread: (5,) standard deviations of where single steps from points about the mode lead: 0 of a linear twin.
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
    spread: np.ndarray

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
            if end.forward == best.forward and end.log_density > best.log_density - AS_LIKELY and apart(end)
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
    return Mode(model, coefficients, sizes, covariance, blocks, residual, jacobian, ends, 0, np.zeros(5))


def blocks_at(model: SessionModel, coefficients: np.ndarray, finer: int = FINER) -> tuple[Block, ...]:
    """Return the blocks of the fitted trials, with their sensitivities at coefficients (5,).

    Args:
        model: the trials.
        coefficients: (5,) where.
        finer: number of fine steps in one step of the twin, see `time_step_errors`.
    """
    motions = trajectories_together(model.trials, coefficients[None])
    sensitivities = sensitivities_together(model.trials, coefficients, motions)
    trials = zip(model.trials, sensitivities, time_step_errors(model.trials, coefficients, motions, finer), strict=True)
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


def time_step_errors(
    trials: Sequence[TrialModel], coefficients: np.ndarray, motions: Sequence[Trajectories], finer: int = FINER
) -> list[np.ndarray]:
    """Return, for each trial, what simulated features (k,) lack against a vanishing time step, at coefficients (5,).

    It follows from the change to fine steps, as the integrator is of first order in the limit (Richardson 1911); half
    steps are too coarse to tell in which direction the features move. A calibrated model swims with
    whole steps, water does not: the coefficients may be those of either, so the error widens intervals.

    Args:
        trials: the trials.
        coefficients: (5,).
        motions: what swims there with whole steps, in each trial.
        finer: number of fine steps in one step of the twin that are compared with it.
    """
    twin = trials[0].twin
    stepped = twin.at_step(twin.scene.timestep_s / finer)
    whole = [trial.features_of(motion) for trial, motion in zip(trials, motions, strict=True)]
    fine = simulated_together([replace(trial, twin=stepped) for trial in trials], coefficients[None])
    vanishing = finer / (finer - 1)
    return [vanishing * np.nan_to_num(after[0] - before[0]) for before, after in zip(whole, fine, strict=True)]


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
