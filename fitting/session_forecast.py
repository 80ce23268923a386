"""Forecasts of a session: every fitted and held-out trial, scored beside simple rules.

`forecast_session` makes the forecasts (`fitting.forecast`) and compares markers, speed and frequency with what was
measured, also for the rules of `fitting.baselines`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from fitting.baselines import BASELINES
from fitting.forecast import (
    EVEN,
    NORMAL_90,
    FeatureForecast,
    Scatter,
    Windows,
    forecast_new,
    forecast_repeat,
    scatter_of,
    tracks_of,
)
from fitting.mode import Mode
from fitting.phase import score
from fitting.picture_scale import scale_sd
from fitting.pool import forward_speed
from fitting.trial import MeasuredTrial
from tracking.head_frame import HeadFrame

_MM = 1000.0  # mm in a metre
_SCALES = 9  # number of scales that a gain is computed at
_FEWEST_TRIALS = 2  # trials that an interval over trials needs
# Models that forecast a session, by the name in results
TWIN = "twin"
GIVEN = "given_frequency"
BEATS = "after_two_beats"
REPEAT = "repeat"
CONTINUED = "continued"
DRAWN = "posterior"


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
        scale_sd: relative standard deviation of the scale that all measured speeds have in common.
    """

    scatter: Scatter
    trials: Mapping[str, ForecastTrial]
    scale_sd: float = 0.0

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

    def gain_of_twin(self, baseline: str) -> "Gain":
        """Return how much better the exported twin forecasts held-out speeds than a baseline through measured speeds.

        The measured speeds have the error of their scale in common, and so has the baseline, but not the twin. So the
        interval is the widest over the trials at any scale within its own 90 % interval.
        """
        errors = [
            np.array([self._gain(trial, baseline, 1 + off) for trial in self.held_out])
            for off in self.scale_sd * NORMAL_90 * np.linspace(-1.0, 1.0, _SCALES)
        ]
        means = [float(each.mean()) if len(each) else float("nan") for each in errors]
        as_measured, best = means[_SCALES // 2], max(means)
        if len(errors[0]) < _FEWEST_TRIALS:
            return Gain(as_measured, None, best)
        quantile = student.ppf(0.95, len(errors[0]) - 1)
        reaches = [float(quantile * each.std(ddof=1) / np.sqrt(len(each))) for each in errors]
        low = min(mean - reach for mean, reach in zip(means, reaches, strict=True))
        high = max(mean + reach for mean, reach in zip(means, reaches, strict=True))
        return Gain(as_measured, (low, high), best)

    def _gain(self, trial: ForecastTrial, baseline: str, by: float) -> float:
        """Return by how much the twin's error is smaller in one trial, were all measured speeds larger by a factor."""
        if not {baseline, TWIN} <= set(trial.forecasts):
            return float("nan")
        twin = abs(trial.forecasts[TWIN].speed - by * trial.speed_measured)
        return by * self._value(trial, baseline, "speed_error") - twin

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
    """Mean over trials by which an absolute speed error is smaller, m/s.

    Attributes:
        mean: with speeds as measured.
        interval: 90 % interval over trials (Student's) and over the scale; None with fewer than two trials.
        at_best: the largest mean at any scale within the 90 % interval of the scale.
    """

    mean: float
    interval: tuple[float, float] | None
    at_best: float


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
    length_m = mode.model.trials[0].twin.robot.scale_length_m
    doubt = max((scale_sd(block.model.trial, length_m) for block in mode.blocks), default=0.0)
    return SessionForecast(scatter, {trial.name: found[trial.name] for trial in trials}, doubt)


def simple_rules(fitted: Sequence[MeasuredTrial], hz: float) -> dict[str, Forecast]:
    """Return the baselines in frequency through fitted trials, for a trial at `hz`."""
    known = [trial.frequency.hz for trial in fitted], [trial.speed for trial in fitted]
    return {name: Forecast(baseline.rule(*known, [hz])[0]) for name, baseline in BASELINES.items()}


def score_forecast(trial: MeasuredTrial, forecast: FeatureForecast, seed: int) -> Forecast:
    """Score a trial within a forecast of it.

    Args:
        trial: the trial.
        forecast: the forecast.
        seed: seed of the bands.
    """
    plain = _score_distances(trial, forecast.head)
    reach = NORMAL_90 * forecast.speed_sd
    band = plain.speed - reach, plain.speed + reach
    return replace(plain, speed_ci90=band, inside=forecast.inside(trial.scored, seed))


def _forecast_fitted(mode: Mode, number: int, seed: int) -> ForecastTrial:
    trial = mode.blocks[number].model.trial
    found = {REPEAT: score_forecast(trial, forecast_repeat(mode, number), seed)}
    return ForecastTrial(trial.role, trial.frequency.hz, trial.speed, found)


def _forecast_held_out(mode: Mode, trial: MeasuredTrial, scatter: Scatter, seed: int) -> ForecastTrial:
    windows, fitted = Windows.of(mode, trial), [block.model.trial for block in mode.blocks]
    given, after_beats = forecast_new(mode, windows, scatter)
    found = {GIVEN: score_forecast(trial, given, seed)}
    if windows.early is not None and after_beats is not None:
        found[BEATS] = score_forecast(trial, after_beats, seed)
        goes_on = _score_distances(trial, trial.seen_head(tracks_of(windows.early.measured[None], windows.late)[0]))
        shown = windows.early.reader.read | ~windows.late.reader.read
        found[CONTINUED] = goes_on if shown.all() else Forecast(goes_on.speed)
    at = trial.start_frequency.hz
    return ForecastTrial(trial.role, at, trial.speed, found | simple_rules(fitted, at))


def _score_distances(trial: MeasuredTrial, head: HeadFrame) -> Forecast:
    scores = score(trial, head)
    speed = float(forward_speed(trial.time_s, head, trial.kept, trial.frequency.hz))
    return Forecast(speed, None, _MM * scores.marker_error_m, _MM * scores.shape_error_m)
