"""Every trial of a session beside what the model forecasts of it, and beside what simple baselines do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.coefficient_fit import NAMES
from fitting.in_pool import head_frame
from fitting.model.features import SPEED
from fitting.model.forecast import (
    NORMAL_90,
    FeatureForecast,
    Scatter,
    Windows,
    forecast_after_beats,
    forecast_from_command,
    repeated,
    scatter_of,
    tracks_of,
)
from fitting.model.mode import Mode, Progress, find_mode
from fitting.model.robot_doubt import Doubt, doubted_twins
from fitting.model.session_model import START_PHASE_RAD, SessionModel
from fitting.model.trial_model import TrialModel
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.scoring import score
from fitting.speed import forward_speed
from fitting.speed_line import speed_constant_stride, speed_line, speed_power_law
from fitting.trial import MeasuredTrial
from session import Flag, NotEnoughData
from session.results import ResultFile
from swimmer import FluidCoefficients, Twin
from tracking import HeadFrame

TWIN, COMMAND, BEATS, REPEAT, CONTINUED = "twin", "from_command", "after_two_beats", "repeat", "continued"
BASELINES = {"line": speed_line, "power_law": speed_power_law, "constant_stride": speed_constant_stride}
_MM = 1000.0
_AT_BOUND = 1e-3


@dataclass(frozen=True)
class Forecast:
    """What one model says of one trial.

    Attributes:
        speed: forward, slope over the whole beats that are scored, m/s.
        speed_ci90: its band, m/s; None where the model has none.
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
        forecasts: by model. Of a held-out trial "twin" (alone), "from_command" (with what the fitted trials tell of the
            twin's error), "after_two_beats" (and with what its own first two beats tell), and the baselines "continued"
            (goes on as in its first two beats), "line", "power_law" and "constant_stride". Of a fitted one "twin" and
            "repeat": what another trial like it would do.
    """

    role: str
    frequency_hz: float
    speed_measured: float
    forecasts: Mapping[str, Forecast]


@dataclass(frozen=True)
class SessionForecast:
    """All trials of a session.

    Attributes:
        coefficients: the mode of the model.
        ci90: of each coefficient, by the curvature at the mode.
        components: standard deviation of each variance component (see `fitting.model.variance`).
        scatter: by how much beats differ within a trial.
        trials: by name.
        flags: when not to believe it.
    """

    coefficients: FluidCoefficients
    ci90: Mapping[str, tuple[float, float]]
    components: Mapping[str, float]
    scatter: Scatter
    trials: Mapping[str, ForecastTrial]
    flags: tuple[Flag, ...]


FORECAST = ResultFile("forecast.json", SessionForecast)


@threadpool_limits.wrap(limits=1, user_api="blas")  # the matrices are small: threads cost more than they save
def forecast_session(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    doubts: Sequence[Doubt],
    starts: int = 3,
    seed: int = 0,
    tell: Progress = lambda _message, _share: None,
) -> SessionForecast:
    """Fits the model to the trials of the role "fit", and forecasts all others.

    Args:
        trials: all swim trials.
        twin: with their markers, of the robot with its structure.
        doubts: how well the numbers of the robot are known.
        starts: of the search for the mode.
        seed: of all draws.
        tell: of the progress.

    Raises:
        NotEnoughData: no trial has the role "fit".
        SimulationDiverged: from every start.
    """
    fitted = [trial for trial in trials if trial.role == "fit"]
    if not fitted:
        raise NotEnoughData('no swim has role = "fit"; give at least one trial of session.toml that role')
    doubted = doubted_twins(twin, doubts)
    windows = (TrialModel(twin, trial, START_PHASE_RAD, doubted, with_course=True) for trial in fitted)
    mode = find_mode(SessionModel(tuple(windows)), starts, seed, tell)
    tell("forecasting the trials", 0.9)
    scatter = scatter_of(mode)
    found = {trial.name: _fitted(mode, number, seed) for number, trial in enumerate(fitted)}
    for trial in trials:
        if trial.role != "fit":
            found[trial.name] = _held_out(mode, trial, fitted, scatter, seed)
    sd = np.sqrt(np.diag(mode.coefficient_covariance))
    low, high = (np.clip(mode.coefficients + sign * NORMAL_90 * sd, *COEFFICIENT_BOUNDS) for sign in (-1, 1))
    return SessionForecast(
        coefficients=FluidCoefficients(*map(float, mode.coefficients)),
        ci90={name: (float(a), float(b)) for name, a, b in zip(NAMES, low, high, strict=True)},
        components=mode.sizes,
        scatter=scatter,
        trials={trial.name: found[trial.name] for trial in trials},
        flags=_flags(mode),
    )


def _fitted(mode: Mode, number: int, seed: int) -> ForecastTrial:
    trial = mode.blocks[number].model.trial
    again = repeated(mode, number)
    twin = Forecast(_speed_of(again, mode.simulated(number)))
    return ForecastTrial(trial.role, trial.frequency.hz, trial.speed, {TWIN: twin, REPEAT: _scored(trial, again, seed)})


def _held_out(
    mode: Mode, trial: MeasuredTrial, fitted: Sequence[MeasuredTrial], scatter: Scatter, seed: int
) -> ForecastTrial:
    windows = Windows.of(mode, trial)
    told = forecast_from_command(mode, windows.late, scatter)
    alone = windows.late.simulated(mode.coefficients[None])[0]
    found = {TWIN: Forecast(_speed_of(told, alone)), COMMAND: _scored(trial, told, seed)}
    if windows.early is not None:
        found[BEATS] = _scored(trial, forecast_after_beats(mode, windows, scatter), seed)
        goes_on = head_frame(trial.markers, tracks_of(windows.early.measured[None], windows.late)[0])
        found[CONTINUED] = _distances(trial, goes_on)
    hz, speed = [each.frequency.hz for each in fitted], [each.speed for each in fitted]
    at = trial.start_frequency.hz
    found |= {name: Forecast(baseline(hz, speed, [at])[0]) for name, baseline in BASELINES.items()}
    return ForecastTrial(trial.role, at, trial.speed, found)


def _scored(trial: MeasuredTrial, forecast: FeatureForecast, seed: int) -> Forecast:
    plain = _distances(trial, forecast.head)
    reach = NORMAL_90 * forecast.speed_sd
    return Forecast(
        plain.speed,
        (plain.speed - reach, plain.speed + reach),
        plain.marker_error_mm,
        plain.shape_error_mm,
        forecast.inside(trial.scored, seed),
    )


def _distances(trial: MeasuredTrial, head: HeadFrame) -> Forecast:
    scores = score(trial, head)
    speed = float(forward_speed(trial.time_s, head.forward_m, trial.kept, trial.frequency.hz))
    return Forecast(speed, None, _MM * scores.marker_error_m, _MM * scores.shape_error_m)


def _speed_of(like: FeatureForecast, features: np.ndarray) -> float:
    """By the same estimator as the forecast's, to which it differs as the speeds among the features do, m/s."""
    trial = like.window.trial
    speed = float(forward_speed(trial.time_s, like.head.forward_m, trial.kept, trial.frequency.hz))
    return speed + float(features[SPEED] - like.mean[SPEED])


def _flags(mode: Mode) -> tuple[Flag, ...]:
    best, (low, high) = mode.ends[0], COEFFICIENT_BOUNDS
    flags = [
        Flag("at_bound", message=f"{name} = {value:.3g} is at its bound {bound:g}")
        for name, value in zip(NAMES, mode.coefficients, strict=True)
        for bound in (low, high)
        if abs(value - bound) < _AT_BOUND * (high - low)
    ]
    if not best.converged:
        flags.append(Flag("not_converged", message="the likeliest start had not converged: a likelier fit may be near"))
    if not best.forward:
        flags.append(Flag("swims_backward", message="started from rest, this twin swims backward at some frequencies"))
    if others := mode.disagree:
        message = f"{len(others)} other starts are as likely and end elsewhere: these trials allow several fits"
        flags.append(Flag("restarts_disagree", message=message))
    return tuple(flags)
