"""Predictions of the posterior with their bands, and the test of the noise model on which the bands rest.

`whiteness` tests the noise model: its residual must be white, in time and between neighbours. All samples of a trial
are freed at once of what the noise model correlates, and of a smooth swim.

`predict_trials` predicts each trial by the draws, `predict_sweep` trials that could still be swum. Given coefficients
all else is normal, as in every forecast of the model: what all trials share is known from those that were fitted, what
is a trial's own is drawn anew. Inner bands are those of the means, by what the draws leave open; outer ones include
everything that differs between the twin and a trial. Features are compared in step with the tail.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.stats import chi2

from fitting.baselines import START_SPEED_M_S
from fitting.covariance import Block, Covariance
from fitting.features import SPEED, harmonics_of
from fitting.forecast import FeatureForecast, Forecast, Windows, block_of, draws_about, root_of, scatter_of, scored
from fitting.mode import Mode, coefficient_covariance, jacobian_at
from fitting.noise import beside
from fitting.posterior.posterior import Posterior
from fitting.progress import Progress
from fitting.signatures import imagined
from fitting.trial import HARMONICS, MeasuredTrial
from fitting.trial_model import TrialModel
from swimcal.errors import Flag

# The test of the noise
_LAGS = 20  # largest number of lags
_ENOUGH = 40  # least frames in which a marker, or two neighbours, must be seen
_OUTSIDE = 0.2  # share of the lags that may lie outside their 95 % band
_BY_CHANCE = 0.99  # share of trials with white noise that stay below the limit of neighbours
_SAMPLES = 2400  # samples that are freed of correlation at once
_DIFFUSE = 1e10  # variance of each number of the smooth swim, against that of a sample
_DETERMINED = 1e3  # standard deviation of a forecast, against that of a sample, below which the swim is determined
_RATES = ("", ", up to the third harmonic")  # the two rows of correlations between neighbours, in words

# Predictions
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # those of every band
DRAWS = 40  # draws of the coefficients for a trial
_SWEEP_DRAWS = 24  # draws of the coefficients for the sweep
SECONDS = 5.0  # length of a further trial
_NOISES = 20  # draws of everything else for each draw of the coefficients
_FEWEST_INSIDE = 0.8  # share of marker coordinates within 90 % bands: chance leaves 0.83 and more in 19 of 20 trials


# The test of the noise model.


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Correlation of the residuals of one trial's tracks about a smooth swim, before and after the noise model.

    Attributes:
        trial: name of the trial.
        lag_s: (l,) lags, from one frame on.
        raw: (l,) autocorrelation of the residuals.
        innovations: (l,) autocorrelation of what the model takes for independent.
        limit: bound within which 95 % of the lags of white noise lie.
        neighbours_raw: (2, m - 1) correlation between neighbours from nose to fin, of the residuals: of all rates, and
            of those no faster than the third harmonic of the beat, which features read.
        neighbours: (2, m - 1) the same correlation of what the model takes for independent.
        neighbours_limit: (2,) bound below which the root mean square of these lies in 99 % of trials with white noise.
        frames: number of frames.
        effective: number of independent frames that would determine a mean as well.
        white: share of the noise's variance that is white.
        lasts_s: time in which the correlation of the rest falls to 1/e.
        sd_m: (m,) standard deviation of each marker.
    """

    trial: str
    lag_s: np.ndarray
    raw: np.ndarray
    innovations: np.ndarray
    limit: float
    neighbours_raw: np.ndarray
    neighbours: np.ndarray
    neighbours_limit: np.ndarray
    frames: int
    effective: float
    white: float
    lasts_s: float
    sd_m: np.ndarray

    @property
    def outside(self) -> float:
        """Share of the lags that lie outside the limit."""
        return float((np.abs(self.innovations) > self.limit).mean())

    @property
    def neighbour_correlation(self) -> np.ndarray:
        """Root mean square of the correlations between neighbours after the model, (2,)."""
        return _rms(self.neighbours)

    @property
    def neighbour_correlation_raw(self) -> np.ndarray:
        """Root mean square of the correlations between neighbours before the model, (2,)."""
        return _rms(self.neighbours_raw)

    @property
    def in_time(self) -> bool:
        """Whether at most a fifth of the lags lie outside the limit."""
        return self.outside <= _OUTSIDE

    @property
    def across(self) -> bool:
        """Whether neighbours are no more correlated after the model than by chance."""
        return not (self.neighbour_correlation > self.neighbours_limit).any()

    @property
    def is_white(self) -> bool:
        """Whether the residual is white in time and across markers."""
        return self.in_time and self.across

    @property
    def fault(self) -> str:
        """Description of what is not white after the model; an empty text where all is."""
        said = []
        if not self.in_time:
            said.append(
                f"{100 * self.outside:.0f} % of the lags lie outside the band of white noise, at most "
                f"{100 * _OUTSIDE:.0f} % may"
            )
        if not self.across:
            worst = int(np.argmax(self.neighbour_correlation / self.neighbours_limit))
            said.append(
                f"neighbouring markers correlate by {self.neighbour_correlation[worst]:.2f} (root mean square"
                f"{_RATES[worst]}), at most {self.neighbours_limit[worst]:.2f} is chance"
            )
        return " and ".join(said)


def noise_flags(found: Sequence[Whiteness]) -> list[Flag]:
    """Flag each trial whose noise is not as the model takes it to be."""
    return [
        Flag(
            "noise_not_white",
            message=f"{one.trial}: what the noise model leaves of the tracks is not white: {one.fault}; "
            "intervals may be too narrow or too wide",
        )
        for one in found
        if not one.is_white
    ]


def whiteness(model: TrialModel) -> Whiteness:
    """Test the noise of one trial's tracks; of a long trial, that of its beginning."""
    reader, noise, columns = model.reader, model.noise, beside(model.reader)
    seen = reader.usable.sum(axis=0) >= max(_ENOUGH, 2 * columns.shape[1])
    along_m = model.twin.robot.marker_positions_m(model.trial.markers)[:, 0]
    order = np.array([m for m in np.argsort(along_m) if seen[m]], int)
    usable = reader.usable[: _SAMPLES // max(len(order), 1), order]
    scaled = model.trial.position_m[model.trial.kept][: len(usable), order] / noise.sd_m[order, None]
    both = _beside_swim(columns[: len(usable)], scaled, usable), _innovations(columns, scaled, usable, model, order)
    time_s = reader.time_s[: len(usable)]
    lags = range(1, min(_LAGS, len(usable) // 4) + 1)
    raw, innovations = (
        np.array([_correlation(each[:-lag].reshape(-1, 2), each[lag:].reshape(-1, 2)) for lag in lags]) for each in both
    )
    fastest_hz = HARMONICS * np.ptp(reader.turn_rad) / (2 * np.pi * np.ptp(reader.time_s))
    slow = np.exp(-0.5 * (2 * np.pi * fastest_hz * (time_s[:, None] - time_s)) ** 2)
    weights = np.eye(len(time_s)), slow
    pairs = [m for m in range(len(order) - 1) if usable[:, m : m + 2].all(axis=1).sum() >= _ENOUGH]
    neighbours_raw, neighbours = (
        np.array([[_correlation(each[:, m], each[:, m + 1], weight) for m in pairs] for weight in weights])
        for each in both
    )
    chance = np.array([sum(_chance(both[1][:, m : m + 2], weight) for m in pairs) for weight in weights])
    count = max(len(pairs), 1)
    return Whiteness(
        trial=model.trial.name,
        lag_s=float(np.median(np.diff(reader.time_s))) * np.array(lags),
        raw=raw,
        innovations=innovations,
        limit=1.96 / np.sqrt(max(np.isfinite(both[1]).sum(), 1)),
        neighbours_raw=neighbours_raw,
        neighbours=neighbours,
        neighbours_limit=np.sqrt(chi2.ppf(_BY_CHANCE, count) * chance) / count,
        frames=len(reader.time_s),
        effective=noise.effective,
        white=noise.white,
        lasts_s=noise.lasts_s,
        sd_m=noise.sd_m,
    )


def _beside_swim(columns: np.ndarray, scaled: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return the residuals (n, m, 2) about a smooth swim, by least squares; nan where a sample does not count."""
    found = np.full(scaled.shape, np.nan)
    for m, own in enumerate(usable.T):
        found[own, m] = scaled[own, m] - columns[own] @ np.linalg.lstsq(columns[own], scaled[own, m], rcond=None)[0]
    return found


def _innovations(
    columns: np.ndarray, scaled: np.ndarray, usable: np.ndarray, model: TrialModel, order: np.ndarray
) -> np.ndarray:
    """Return the innovations (n, m, 2): each sample less its forecast by all before it, over the forecast's sd.

    The smooth swim has a diffuse prior: innovations are independent, but for the first ones, which determine it. Those
    are nan, as samples are that do not count (recursive residuals; Brown, Durbin and Evans 1975).
    """
    noise, time_s = model.noise, model.reader.time_s
    frame, place = np.nonzero(usable)
    own, rows, markers = place[:, None] == place, np.ix_(frame, frame), np.ix_(order[place], order[place])
    covariance = np.where(own, noise.correlation[rows] + _DIFFUSE * (columns @ columns.T)[rows], 0.0)
    for part in noise.parts:
        covariance += np.where(own, 0.0, part.across[markers] * part.over(time_s)[rows])
    root = np.linalg.cholesky(covariance)
    found = np.full(scaled.shape, np.nan)
    known = np.diag(root) < _DETERMINED
    found[frame[known], place[known]] = solve_triangular(root, scaled[frame, place], lower=True)[known]
    return found


def _correlation(first: np.ndarray, second: np.ndarray, weight: np.ndarray | None = None) -> float:
    """Return the correlation of two series (n, 2) where both count.

    With weights (n, n) it is over products of all pairs, else of each sample with its own.
    """
    counts = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    a, b = first[counts], second[counts]
    left, right = (a, b) if weight is None else (weight[np.ix_(counts, counts)] @ each for each in (a, b))
    return float((left * b).sum() / np.sqrt((left * a).sum() * (right * b).sum()))


def _chance(pair: np.ndarray, weight: np.ndarray) -> float:
    """Return the variance of such a correlation between two markers' white noise (n, 2, 2)."""
    counts = np.isfinite(pair).all(axis=(1, 2))
    own = weight[np.ix_(counts, counts)]
    return float((own**2).sum() / (2 * np.trace(own) ** 2))


def _rms(correlations: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((correlations**2).sum(axis=1) / max(correlations.shape[1], 1)))


# Predictions.


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
        """Whether the measured speed lies within the outer 90 % band."""
        return bool(self.outer[0] <= self.speed <= self.outer[-1])

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Flag for a fitted trial that lies outside its own bands."""
        if self.role != "fit" or (self.speed_inside and self.inside >= _FEWEST_INSIDE):
            return ()
        message = (
            f"{self.name} was fitted and lies outside its own predictive bands: it swims at {1000 * self.speed:.0f} "
            f"mm/s, should at {1000 * self.outer[0]:.0f} to {1000 * self.outer[-1]:.0f}, and {100 * self.inside:.0f} % "
            "of its marker coordinates lie in theirs"
        )
        return (Flag("fit_outside", message=message),)


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
        window = replace(first, trial=trial)
        block = block_of(mode, window, scatter)
        mean, covariance = _predict(posterior, block, draws, _simulate(mode, block, draws))
        speed, sd = mean[:, SPEED], np.sqrt(covariance[SPEED, SPEED])
        inner.append(np.quantile(speed, QUANTILES))
        outer.append(np.quantile(speed[:, None] + sd * random.standard_normal((len(speed), _NOISES)), QUANTILES))
        shrunk.append(np.sqrt(np.diag(_covariance_with(mode, block))) / now)
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
    place_m = model.twin.robot.marker_positions_m(model.trial.markers)[:, 0]
    forecast, read = scored(trial, together, seed), model.reader.read
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


def _covariance_with(mode: Mode, block: Block) -> np.ndarray:
    """Return the covariance (5, 5) of the coefficients with one more trial."""
    total = Covariance.of([*mode.blocks, block], mode.blocks).at(mode.sizes)
    jacobian = np.vstack([mode.jacobian, jacobian_at([block.model], mode.coefficients)])
    return coefficient_covariance(total, jacobian)
