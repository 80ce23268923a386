"""Predictions of the posterior, with their bands.

`predict_trials` predicts each trial by the draws, `predict_sweep` trials that could still be swum. Given coefficients
all else is normal, as in every forecast of the model: what all trials share is known from those that were fitted, what
is a trial's own is drawn anew. Inner bands are those of the means, by what the draws leave open; outer ones include
everything that differs between the twin and a trial. Features are compared in step with the tail.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from fitting.affected_trials import imagined
from fitting.baselines import START_SPEED_M_S
from fitting.covariance import Block, Covariance
from fitting.features import SPEED, harmonics_of
from fitting.forecast import FeatureForecast, Windows, block_of, draws_about, root_of, scatter_of
from fitting.mode import Mode, coefficient_covariance, jacobian_at
from fitting.posterior.posterior import Posterior
from fitting.progress import Progress
from fitting.session_forecast import Forecast, score_forecast
from fitting.trial import MeasuredTrial
from swimcal.flags import Flag

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # those of every band
DRAWS = 40  # draws of the coefficients for a trial
_SWEEP_DRAWS = 24  # draws of the coefficients for the sweep
SECONDS = 5.0  # length of a further trial
_NOISES = 20  # draws of everything else for each draw of the coefficients
_FEWEST_INSIDE = 0.8  # share of marker coordinates within 90 % bands: chance leaves 0.83 and more in 19 of 20 trials


@dataclass(frozen=True, eq=False)
class PredictedTrial:
    """One trial and what the posterior predicts of it.

    Attributes:
        speed: measured forward speed, m/s.
        inner, outer: (5,) quantiles 5, 25, 50, 75, 95 % of the predicted one, m/s.
        place_m: (m,) of each marker that is read along the body.
        swing_m: (m,) measured amplitude of its lateral beat at the crank's frequency.
        swing_inner, swing_outer: (5, m) quantiles of the predicted ones.
        forecast: the mean over the draws, by the measures of every forecast.
    """

    name: str
    role: str
    speed: float
    inner: np.ndarray
    outer: np.ndarray
    place_m: np.ndarray
    swing_m: np.ndarray
    swing_inner: np.ndarray
    swing_outer: np.ndarray
    forecast: Forecast

    @property
    def inside(self) -> float:
        """Share of the scored marker coordinates within their 90 % bands."""
        return float("nan") if self.forecast.inside is None else self.forecast.inside

    @property
    def speed_inside(self) -> bool:
        """Return whether the measured speed lies within the outer 90 % band."""
        return bool(self.outer[0] <= self.speed <= self.outer[-1])

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Flag for a fitted trial that lies outside its own bands."""
        if self.role != "fit" or (self.speed_inside and self.inside >= _FEWEST_INSIDE):
            return ()
        low, high = 1000 * self.outer[0], 1000 * self.outer[-1]
        message = f"{100 * self.inside:.0f} % of the marker coordinates of {self.name}, fitted, lie in their 90 % bands"
        if not self.speed_inside:
            message += f"; it swims at {1000 * self.speed:.1f} mm/s, its band is {low:.1f} to {high:.1f}"
        return (Flag("outside_bands", message=message),)


@dataclass(frozen=True, eq=False)
class PredictedSweep:
    """Speed of trials that could still be swum, over frequency, and the information that each would add.

    Attributes:
        frequency_hz: (f,) frequencies.
        inner, outer: (5, f) quantiles 5, 25, 50, 75, 95 % of the speed, m/s.
        sd: (f, 5) expected standard deviation of each coefficient with one such trial of 5 s more.
        sd_now: (5,) standard deviation of each coefficient without.
    """

    frequency_hz: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    sd: np.ndarray
    sd_now: np.ndarray

    def shrinkage(self, wanted: np.ndarray) -> np.ndarray:
        """Return the factor (f,) by which the standard deviations of wanted coefficients (5,) shrink.

        It is their geometric mean.
        """
        return np.asarray(np.exp(np.log(self.sd[:, wanted] / self.sd_now[wanted]).mean(axis=1)))


def predict_trials(posterior: Posterior, trials: Sequence[MeasuredTrial], seed: int = 0) -> tuple[PredictedTrial, ...]:
    """Predict each trial by draws from the posterior, fit and held-out ones.

    Args:
        posterior: the posterior.
        trials: the trials.
        seed: seed of the draws.
    """
    mode, random = posterior.mode, np.random.default_rng([seed, 4])
    draws, scatter = _choose_draws(posterior, random), scatter_of(mode)
    fitted = {block.model.trial.name: block for block in mode.blocks}
    found = []
    for trial in trials:
        if (own := fitted.get(trial.name)) is not None:
            block = own._replace(trial=len(mode.blocks), features=mode.simulated(own.trial))
            length = len(own.features)
            simulated = posterior.surrogate.likelihood.emulator(draws)[:, own.trial * length :][:, :length]
        else:
            block = block_of(mode, Windows.of(mode, trial).late, scatter)
            simulated = _simulate(mode, block, draws)
        found.append(_of_trial(trial, block, *_predict(posterior, block, draws, simulated), random, seed))
    return tuple(found)


def predict_sweep(
    posterior: Posterior, frequency_hz: np.ndarray, seed: int = 0, tell: Progress = lambda _message, _share: None
) -> PredictedSweep:
    """Predict trials at each of some frequencies, settled and measured like those of the session.

    The information that one would add is that of a linear model (Chaloner and Verdinelli 1995).

    Args:
        posterior: the posterior.
        frequency_hz: (f,) frequencies.
        seed: seed of the draws.
        tell: takes messages with the share of the work that is done.
    """
    mode, random = posterior.mode, np.random.default_rng([seed, 3])
    draws, scatter = _choose_draws(posterior, random, _SWEEP_DRAWS), scatter_of(mode)
    inner, outer, shrunk = [], [], []
    now, first = np.sqrt(np.diag(mode.coefficient_covariance)), mode.model.trials[0]
    seconds = SECONDS + first.trial.warmup_s
    for number, hz in enumerate(frequency_hz):
        tell("predicting the speed over frequency", number / len(frequency_hz))
        trial = imagined(first.twin, first.trial, mode.coefficients, float(hz), START_SPEED_M_S, seconds)
        window = first.of_other(trial)
        block = block_of(mode, window, scatter)
        mean, covariance = _predict(posterior, block, draws, _simulate(mode, block, draws))
        speed, sd = mean[:, SPEED], np.sqrt(covariance[SPEED, SPEED])
        inner.append(np.quantile(speed, QUANTILES))
        outer.append(np.quantile(speed[:, None] + sd * random.standard_normal((len(speed), _NOISES)), QUANTILES))
        total = Covariance.of([*mode.blocks, block], mode.blocks).at(mode.sizes)
        jacobian = np.vstack([mode.jacobian, jacobian_at([block.model], mode.coefficients)])
        shrunk.append(np.sqrt(np.diag(coefficient_covariance(total, jacobian))) / now)
    sd_now = posterior.coefficients.std(axis=0, ddof=1)
    return PredictedSweep(frequency_hz, np.transpose(inner), np.transpose(outer), sd_now * np.array(shrunk), sd_now)


def _choose_draws(posterior: Posterior, random: np.random.Generator, count: int = DRAWS) -> np.ndarray:
    """Choose draws (count, 5) without replacement."""
    return random.choice(posterior.coefficients, count, replace=False)


def _simulate(mode: Mode, block: Block, draws: np.ndarray) -> np.ndarray:
    """Simulate the features (d, k) at the draws (d, 5); where a twin diverges, they are those at the mode."""
    rows = block.model.simulated(np.vstack([mode.coefficients, draws]))
    return np.where(np.isfinite(rows[1:]), rows[1:] - rows[0], 0.0) + block.features


def _predict(
    posterior: Posterior, block: Block, draws: np.ndarray, simulated: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the means (d, k) of the features of a new block at the draws (d, 5), and their covariance (k, k)."""
    mode, count = posterior.mode, len(posterior.mode.residual)
    total = Covariance.of([*mode.blocks, block], mode.blocks).at(mode.forecast_sizes)
    known, cross = total[:count, :count], total[:count, count:]
    gain = cho_solve(cho_factor(known, lower=True), cross)
    off = mode.model.measured - posterior.surrogate.likelihood.emulator(draws)
    return simulated + off @ gain, total[count:, count:] - cross.T @ gain


def _of_trial(
    trial: MeasuredTrial,
    block: Block,
    mean: np.ndarray,
    covariance: np.ndarray,
    random: np.random.Generator,
    seed: int,
) -> PredictedTrial:
    """Build the prediction from means (d, k) by the draws, and the covariance (k, k) about each."""
    model, root = block.model, root_of(covariance)
    outer = np.concatenate([draws_about(mean, random.standard_normal(mean.shape) @ root) for _ in range(_NOISES)])
    together = FeatureForecast(model, mean.mean(axis=0), covariance + np.cov(mean.T))
    place_m = model.along_m
    forecast, read = score_forecast(trial, together, seed), model.reader.read
    chord = forecast.speed - together.speed  # features hold the speed along the path
    return PredictedTrial(
        name=trial.name,
        role=trial.role,
        speed=trial.speed,
        inner=np.quantile(mean[:, SPEED], QUANTILES) + chord,
        outer=np.quantile(outer[:, SPEED], QUANTILES) + chord,
        place_m=(place_m - place_m.min())[read],
        swing_m=_swing(model.measured)[read],
        swing_inner=np.quantile(_swing(mean), QUANTILES, axis=0)[:, read],
        swing_outer=np.quantile(_swing(outer), QUANTILES, axis=0)[:, read],
        forecast=forecast,
    )


def _swing(features: np.ndarray) -> np.ndarray:
    """Return the amplitude (..., m) of each marker's lateral beat."""
    return np.abs(harmonics_of(features)[..., 1, 0])
