"""Forecasts of swims with their bands: conditional normals of features, the tracks they make, and their scores.

Fitted trials tell of a new one what all trials share: coefficients, marker places, the common discrepancy. Its own
first beats tell what is its own: trim, registration of the head frame, boxes. `forecast_of` conditions on both
(Rasmussen and Williams 2006, A.6); `repeated` forecasts another trial like a fitted one. `forecast_session` makes and
scores the forecasts of every trial, beside simple baselines.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from fitting.covariance import Block, Covariance
from fitting.features import COURSE, SPEED, FeatureReader, advanced, of_markers, phase_between
from fitting.mode import Mode, jacobian_at, time_step_errors
from fitting.noise import FeatureNoise
from fitting.phase import SETTLED_S, score
from fitting.pool import BASELINES, forward_speed, waves
from fitting.trial import HARMONICS, MeasuredTrial
from fitting.trial_model import Sensitivities, TrialModel, sensitivities_together, slope_of_phase
from swimcal.errors import NotEnoughData
from tracking.head_frame import HeadFrame

# The model's forecast of one window
NORMAL_90 = 1.645  # half the 90 % interval of a standard normal number
_FEWEST_FRAMES = 24  # least frames of a window
_DRAWS = 200  # draws of tracks, for their bands
_MEDIAN_OF_SQUARE = 0.4549  # median square of a standard normal number
_MM = 1000.0  # mm in a metre
_FEWEST_TRIALS = 2  # trials that an interval over trials needs

# Models that forecast a session, by the name in results
TWIN = "twin"
GIVEN = "given_frequency"
BEATS = "after_two_beats"
REPEAT = "repeat"
CONTINUED = "continued"
DRAWN = "posterior"


# Forecasts of features, and their tracks.


@dataclass(frozen=True, eq=False)
class FeatureForecast:
    """Normal forecast of the features of a window.

    Attributes:
        window: the window that is forecast.
        mean, covariance: (k,) and (k, k) of its features.
        in_step: whether the forecast is put in step with the measured tail, so that its phase is not uncertain.
    """

    window: TrialModel
    mean: np.ndarray
    covariance: np.ndarray
    in_step: bool = True

    @property
    def speed(self) -> float:
        """Forward speed, m/s."""
        return float(self.mean[SPEED])

    @property
    def speed_sd(self) -> float:
        """Standard deviation of the forward speed, m/s."""
        return float(np.sqrt(self.covariance[SPEED, SPEED]))

    @cached_property
    def head(self) -> HeadFrame:
        """Forecast tracks in the head frame, (n, m, 2), of all frames of the trial."""
        return self._head_of(self.mean[None], one=True)

    def inside(self, frames: np.ndarray, seed: int = 0) -> float:
        """Return the share of the measured samples within the 90 % bands of their tracks.

        Args:
            frames: (n,) frames that count.
            seed: seed of the bands.
        """
        trial = self.window.trial
        drawn = self._head_of(self._draw(seed))
        low, high = np.quantile(_align(drawn, frames), [0.05, 0.95], axis=0)
        measured = _align(trial.head, frames)
        good = (trial.weight[frames] > 0) & np.isfinite(measured).all(axis=-1)
        return float(((measured >= low) & (measured <= high))[good].mean())

    def _draw(self, seed: int) -> np.ndarray:
        """Draw features (d, k) from the forecast."""
        noise = np.random.default_rng([seed, 31]).standard_normal((_DRAWS, len(self.mean)))
        drawn = draws_about(self.mean, noise @ root_of(self.covariance))
        if not self.in_step:
            return drawn
        return advanced(drawn, phase_between(drawn, self.window.measured, list(self.window.trial.tail)))

    def _head_of(self, features: np.ndarray, one: bool = False) -> HeadFrame:
        position_m = tracks_of(features, self.window)
        return self.window.trial.seen_head(position_m[0] if one else position_m)


def root_of(covariance: np.ndarray) -> np.ndarray:
    """Return a matrix (k, k) whose transpose times itself is the covariance (k, k)."""
    values, vectors = np.linalg.eigh(covariance)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def draws_about(mean: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    """Return features with given means and deviations, their phase turned instead of added.

    A phase is uncertain by half a radian: along its tangent that would make every amplitude larger.

    Args:
        mean: (..., k) means.
        deviations: (..., k) deviations from them.
    """
    tangent = slope_of_phase(mean)
    phase = (deviations * tangent).sum(axis=-1) / np.maximum((tangent**2).sum(axis=-1), 1e-300)
    return advanced(mean + deviations - phase[..., None] * tangent, phase)


def tracks_of(features: np.ndarray, window: TrialModel) -> np.ndarray:
    """Return the markers (d, n, m, 2) on the pool that have given features, m.

    Each marker beats about its mean in a frame that goes forward and sideways, and turns, at steady rates.

    Args:
        features: (d, k) features with a course.
        window: window whose trial gives the n frames.
    """
    trial = window.trial
    turn_rad = trial.crank_rad(trial.time_s, trial.frequency.hz)
    columns = np.column_stack([np.ones(len(turn_rad)), waves(turn_rad, HARMONICS)])  # (n, 7)
    beats = np.einsum("nc,dmac->dnma", columns, of_markers(features))
    place = beats[..., 0] + 1j * beats[..., 1]
    sideways, turning = features[:, -len(COURSE) :].T
    heading = np.exp(1j * np.multiply.outer(turning, trial.time_s))  # (d, n)
    speed = (features[:, SPEED] + 1j * sideways)[:, None] * heading
    steps = 0.5 * (speed[:, 1:] + speed[:, :-1]) * np.diff(trial.time_s)
    path = np.concatenate([np.zeros((len(features), 1)), np.cumsum(steps, axis=1)], axis=1)
    position = path[..., None] + place * heading[..., None]
    return np.stack([position.real, position.imag], axis=-1)


# Forecasts of a window, given the fitted trials and its own first beats.


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of a held-out trial at the frequency of its first beats.

    Attributes:
        early: its known part; None where that is too short.
        late: its kept frames.
    """

    early: TrialModel | None
    late: TrialModel

    @classmethod
    def of(cls, mode: Mode, trial: MeasuredTrial) -> "Windows":
        """Divide a trial that was not fitted into its windows.

        Raises:
            NotEnoughData: nose and neck are hardly seen in the kept frames.
        """
        late = replace(mode.model.trials[0], trial=replace(trial, frequency=trial.start_frequency))
        known = trial.known & (trial.time_s > SETTLED_S)
        early = replace(late, trial=replace(late.trial, kept=known))
        try:
            both = early.reader.read & late.reader.read
        except NotEnoughData:
            _ = late.reader
            return cls(None, late)
        return cls(early if known.sum() >= _FEWEST_FRAMES and both[list(trial.tail)].any() else None, late)


class Scatter(NamedTuple):
    """Scatter of the windows of a trial.

    Attributes:
        noise: squared differences relative to tracking noise, at least 1.
        speed: relative standard deviation of a window's speed.
    """

    noise: float = 1.0
    speed: float = 0.03


EVEN = Scatter()
"""Scatter of a fish of which nothing is known."""


def repeated(mode: Mode, number: int) -> FeatureForecast:
    """Forecast a repeat of a fitted trial: all that is a trial's own is drawn anew."""
    again = mode.blocks[number]._replace(trial=len(mode.blocks), features=mode.simulated(number))
    rows = len(again.features)
    return _condition(mode, again, mode.jacobian[number * rows :][:rows], None)


class NewWindow(NamedTuple):
    """A window of a new trial as the twin swims it.

    Attributes:
        block: its block.
        jacobian: (k, 5) by the coefficients.
        scatter: its scatter.
    """

    block: Block
    jacobian: np.ndarray
    scatter: Scatter

    @classmethod
    def of(cls, mode: Mode, window: TrialModel, scatter: Scatter = EVEN) -> "NewWindow":
        """Simulate the window at the mode."""
        return cls(block_of(mode, window, scatter), jacobian_at([window], mode.coefficients), scatter)


def forecast_of(mode: Mode, window: NewWindow, early: TrialModel | None = None) -> FeatureForecast:
    """Forecast a window of a new trial from its frequency, the fitted trials, and its own early window.

    Without an early window the forecast is in step with the trial's tail.

    Args:
        mode: the fit.
        window: the window.
        early: the known part of the same trial.
    """
    beats = None if early is None else _early_block(mode, early, window.block, window.scatter)
    return _condition(mode, window.block, window.jacobian, beats)


def scatter_of(mode: Mode) -> Scatter:
    """Estimate the scatter of windows from the fitted trials, each divided after its first two beats.

    For the speed the default counts as one more trial.
    """
    noise, speed = [], [EVEN.speed**2]
    for block in mode.blocks:
        try:
            windows = Windows.of(mode, block.model.trial.with_role("holdout"))
        except NotEnoughData:
            continue
        if windows.early is None:
            continue
        difference = windows.early.measured - windows.late.measured
        of_tracks = np.sum([np.diag(_tracking_noise(mode, each)) for each in (windows.early, windows.late)], axis=0)
        both = windows.early.reader.observed & windows.late.reader.observed
        noise.append(float(np.median(difference[both] ** 2 / of_tracks[both])) / _MEDIAN_OF_SQUARE)
        speed.append(float((difference[SPEED] / block.features[SPEED]) ** 2 / 2))
    return Scatter(max(1.0, float(np.mean(noise))) if noise else 1.0, float(np.sqrt(np.mean(speed))))


def block_of(mode: Mode, window: TrialModel, scatter: Scatter) -> Block:
    """Return the block of a window of a new trial; its features are what the twin simulates.

    Args:
        mode: the fit.
        window: the window.
        scatter: scatter of windows.
    """
    (sensitivities,) = sensitivities_together([window], mode.coefficients)
    (time_step,) = time_step_errors([window], mode.coefficients)
    simulated = window.simulated(mode.coefficients[None])[0]
    noise = _noise(mode, window, scatter, simulated)
    return Block(window, sensitivities, noise, time_step, len(mode.blocks), simulated)


def _early_block(mode: Mode, window: TrialModel, late: Block, scatter: Scatter) -> tuple[Block, float]:
    """Return the block of the first beats of a new trial, and their phase ahead of the late window.

    Both are windows of one steady swim: the twin's start, which is not the fish's, is not simulated.
    """
    phase = float(phase_between(late.features, window.measured, list(window.trial.tail)))
    sensitivities = Sensitivities(*(_ahead(each, phase) for each in late.sensitivities))
    features, time_step = (_ahead(each[:, None], phase)[:, 0] for each in (late.features, late.time_step))
    noise = _noise(mode, window, scatter, features)
    return Block(window, sensitivities, noise, time_step, late.trial, features), phase


def _ahead(columns: np.ndarray, phase: float) -> np.ndarray:
    """Return columns (k, q) of features with the crank ahead by a phase, rad."""
    return advanced(columns.T, np.full(columns.shape[1], phase)).T


def _noise(mode: Mode, window: TrialModel, scatter: Scatter, simulated: np.ndarray) -> np.ndarray:
    """Return the covariance (k, k) of a window by noise like the fitted trials' and by the windows' scatter."""
    found = scatter.noise * _tracking_noise(mode, window)
    found[SPEED, SPEED] += (scatter.speed * simulated[SPEED]) ** 2
    return found


def _tracking_noise(mode: Mode, window: TrialModel) -> np.ndarray:
    reader: FeatureReader = window.reader
    return FeatureNoise.typical([block.model.noise for block in mode.blocks], reader.time_s).covariance(reader)


def _condition(mode: Mode, late: Block, jacobian: np.ndarray, early: tuple[Block, float] | None) -> FeatureForecast:
    """Condition a block on the fitted trials and, where there is one, on an early window of its trial.

    The early window is ahead by a phase. The coefficients stay those of the fit, with its covariance: an update of them
    by the wider discrepancy of forecasts would be linear, and leads far off where they are uncertain.
    """
    blocks, rows, residual = [*mode.blocks, late], [mode.jacobian, jacobian], mode.residual
    if early is not None:
        block, phase = early
        blocks, rows = [*blocks, block], [*rows, _ahead(jacobian, phase)]
        residual = np.append(residual, block.model.measured - block.features)
    total = Covariance.of(blocks, mode.blocks).at(mode.forecast_sizes)
    slopes, count, length = np.vstack(rows), len(mode.residual), len(late.features)
    asked = np.arange(count, count + length)
    known = np.delete(np.arange(len(total)), asked)
    factor = cho_factor(total[np.ix_(known, known)], lower=True)
    gain = cho_solve(factor, total[np.ix_(known, asked)]).T
    covariance = total[np.ix_(asked, asked)] - gain @ total[np.ix_(known, asked)]
    of_coefficients = slopes[asked] - gain @ slopes[known]
    covariance += of_coefficients @ mode.coefficient_covariance @ of_coefficients.T
    return FeatureForecast(late.model, late.features + gain @ residual, covariance, in_step=early is None)


def _align(head: HeadFrame, frames: np.ndarray) -> np.ndarray:
    """Return the positions (..., k, m, 2) in the head frame, displacement counted from the first of the frames (n,)."""
    first = int(np.flatnonzero(frames)[0])
    path = head.path_m[..., frames, :] - head.path_m[..., first : first + 1, :]
    return np.asarray(head.shape_m[..., frames, :, :] + path[..., None, :])


# Forecasts of a session, and their scores.


@dataclass(frozen=True)
class Forecast:
    """Forecast of one trial by one model.

    Attributes:
        speed: forward, slope over the whole beats that are scored, m/s.
        speed_ci90: its 90 % band, m/s; None where the model has none.
        marker_error_mm, shape_error_mm: as the public contract defines them; None where it forecasts no markers.
        inside: share of the scored marker coordinates within their 90 % bands.
    """

    speed: float
    speed_ci90: tuple[float, float] | None = None
    marker_error_mm: float | None = None
    shape_error_mm: float | None = None
    inside: float | None = None


@dataclass(frozen=True)
class ForecastTrial:
    """One trial.

    Attributes:
        role: "fit" or "holdout".
        frequency_hz: that forecasts are asked for at: of its first two beats where it is held out.
        speed_measured: m/s.
        forecasts: by model. Of every trial "twin" (the calibrated twin alone) and elongated body theory in its forms
            from the measured tail ("ebt_published", "ebt_smoothed", "ebt_large"). Of a held-out one "given_frequency"
            (the twin with what the fitted trials tell of its error), "after_two_beats" (and with what its own first
            two beats tell), and the baselines "continued" (goes on as in its first two beats), "line", "power_law" and
            "constant_stride". Of a fitted one "repeat": what another trial like it would do. Beside a posterior
            "posterior": "given_frequency" or "repeat", averaged over its draws.
    """

    role: str
    frequency_hz: float
    speed_measured: float
    forecasts: Mapping[str, Forecast]


@dataclass(frozen=True)
class SessionForecast:
    """Forecasts of all trials of a session.

    Attributes:
        scatter: by how much beats differ within a trial.
        trials: the forecasts of each trial, by its name.
    """

    scatter: Scatter
    trials: Mapping[str, ForecastTrial]

    @property
    def held_out(self) -> tuple[ForecastTrial, ...]:
        """Trials that the coefficients are not fitted to."""
        return tuple(trial for trial in self.trials.values() if trial.role != "fit")

    @property
    def compared(self) -> "SessionForecast":
        """The forecasts with those held-out trials alone for which every model has a speed.

        So all means are over the same trials. Elongated body theory has no speed where boxes at the tail tip merge.
        """
        told = {
            name: {model for model, found in trial.forecasts.items() if np.isfinite(found.speed)}
            for name, trial in self.trials.items()
            if trial.role != "fit"
        }
        every = set().union(*told.values())
        return replace(
            self, trials={name: trial for name, trial in self.trials.items() if told.get(name, every) == every}
        )

    def mean(self, model: str, quantity: str) -> float:
        """Return the mean over held-out trials of a quantity of `Forecast`; nan where it is unknown.

        Args:
            model: name of the model.
            quantity: a field of `Forecast`, or "speed_error" (absolute, m/s).
        """
        found = [self._value(trial, model, quantity) for trial in self.held_out]
        return float(np.mean(found)) if found else float("nan")

    @property
    def best_baseline(self) -> str:
        """Name of the baseline with the smallest speed error that needs no beat of the trial itself; "" without any."""
        errors = {name: self.mean(name, "speed_error") for name in BASELINES}
        known = {name: error for name, error in errors.items() if np.isfinite(error)}
        return min(known, key=known.__getitem__) if known else ""

    def gain(self, model: str, baseline: str) -> "Gain":
        """Return how much better a model forecasts held-out speeds than a baseline."""
        found = np.array(
            [self._value(t, baseline, "speed_error") - self._value(t, model, "speed_error") for t in self.held_out]
        )
        if len(found) < _FEWEST_TRIALS:
            return Gain(float(found.mean()) if len(found) else float("nan"), None)
        reach = float(student.ppf(0.95, len(found) - 1) * found.std(ddof=1) / np.sqrt(len(found)))
        return Gain(float(found.mean()), (float(found.mean()) - reach, float(found.mean()) + reach))

    def with_models(self, further: Mapping[str, Mapping[str, Forecast]]) -> "SessionForecast":
        """Return the forecasts with further ones, by trial and model, in front."""
        trials = {
            name: replace(trial, forecasts={**further[name], **trial.forecasts}) for name, trial in self.trials.items()
        }
        return replace(self, trials=trials)

    @staticmethod
    def _value(trial: ForecastTrial, model: str, quantity: str) -> float:
        if model not in trial.forecasts:
            return float("nan")
        found = trial.forecasts[model]
        if quantity == "speed_error":
            return abs(found.speed - trial.speed_measured)
        value = getattr(found, quantity)
        return float("nan") if value is None else float(value)


NOTHING_FORECAST = SessionForecast(EVEN, {})
"""The forecasts of a session before its trials are forecast."""


class Gain(NamedTuple):
    """Mean over trials by which an absolute speed error is smaller, m/s, with its 90 % interval over trials.

    The interval is Student's; None with fewer than two trials.
    """

    mean: float
    interval: tuple[float, float] | None


@threadpool_limits.wrap(limits=1, user_api="blas")  # the matrices are small: threads cost more than they save
def forecast_session(mode: Mode, trials: Sequence[MeasuredTrial], seed: int = 0) -> SessionForecast:
    """Return the model's forecasts of its own trials and of all others.

    Args:
        mode: the fit.
        trials: all trials of the session.
        seed: seed of the bands.
    """
    scatter = scatter_of(mode)
    found = {block.model.trial.name: _forecast_fitted(mode, number, seed) for number, block in enumerate(mode.blocks)}
    for trial in trials:
        if trial.role != "fit":
            found[trial.name] = _forecast_held_out(mode, trial, scatter, seed)
    return SessionForecast(scatter, {trial.name: found[trial.name] for trial in trials})


def simple_rules(fitted: Sequence[MeasuredTrial], hz: float) -> dict[str, Forecast]:
    """Return the baselines in frequency through fitted trials, for a trial at `hz`."""
    known = [trial.frequency.hz for trial in fitted], [trial.speed for trial in fitted]
    return {name: Forecast(baseline(*known, [hz])[0]) for name, baseline in BASELINES.items()}


def scored(trial: MeasuredTrial, forecast: FeatureForecast, seed: int) -> Forecast:
    """Score a trial within a forecast of it.

    Args:
        trial: the trial.
        forecast: the forecast.
        seed: seed of the bands.
    """
    plain = _score_distances(trial, forecast.head)
    reach = NORMAL_90 * forecast.speed_sd
    return Forecast(
        plain.speed,
        (plain.speed - reach, plain.speed + reach),
        plain.marker_error_mm,
        plain.shape_error_mm,
        forecast.inside(trial.scored, seed),
    )


def _forecast_fitted(mode: Mode, number: int, seed: int) -> ForecastTrial:
    trial = mode.blocks[number].model.trial
    return ForecastTrial(
        trial.role, trial.frequency.hz, trial.speed, {REPEAT: scored(trial, repeated(mode, number), seed)}
    )


def _forecast_held_out(mode: Mode, trial: MeasuredTrial, scatter: Scatter, seed: int) -> ForecastTrial:
    windows, fitted = Windows.of(mode, trial), [block.model.trial for block in mode.blocks]
    late = NewWindow.of(mode, windows.late, scatter)
    found = {GIVEN: scored(trial, forecast_of(mode, late), seed)}
    if windows.early is not None:
        found[BEATS] = scored(trial, forecast_of(mode, late, windows.early), seed)
        goes_on = _score_distances(trial, trial.seen_head(tracks_of(windows.early.measured[None], windows.late)[0]))
        shown = windows.early.reader.read | ~windows.late.reader.read
        found[CONTINUED] = goes_on if shown.all() else Forecast(goes_on.speed)
    at = trial.start_frequency.hz
    return ForecastTrial(trial.role, at, trial.speed, found | simple_rules(fitted, at))


def _score_distances(trial: MeasuredTrial, head: HeadFrame) -> Forecast:
    scores = score(trial, head)
    speed = float(forward_speed(trial.time_s, head, trial.kept, trial.frequency.hz))
    return Forecast(speed, None, _MM * scores.marker_error_m, _MM * scores.shape_error_m)
