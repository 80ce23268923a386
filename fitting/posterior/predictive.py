"""What the posterior predicts: speed over frequency, and speed and gait of each trial, with bands.

Inner bands carry what is uncertain of the coefficients and, together with them, of the robot; outer ones everything
that stands between the twin and a trial: noise, nuisances, and the twin's own discrepancy. Like the posterior itself,
they are of a twin whose time step vanishes. Held-out trials keep the contract: their frequency and start come
from their own first two beats. Gaits are compared in step, so the phase is not predicted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fitting.model.discrepancy import wave_discrepancy
from fitting.model.features import OF_A_MARKER, SPEED, harmonics_of
from fitting.model.robot_doubt import DoubtedTwin
from fitting.model.session_model import START_PHASE_RAD
from fitting.model.trial_model import TrialModel
from fitting.posterior.posterior import Posterior
from fitting.posterior.shared import SharedNuisances
from fitting.posterior.step_shift import at_vanishing_step
from fitting.speed import forward_speed
from fitting.sweep import START_SPEED_M_S
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin
from tracking import to_head_frame

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
DRAWS = 40
_NOISES = 20  # draws of everything else for each
_SETTLING_BEATS, _BEATS, _LEAST_S, _FRAME_S = 4.0, 3.0, 4.0, 1 / 30  # of a swim in the sweep


@dataclass(frozen=True, eq=False)
class PredictedSweep:
    """Speed over frequency.

    Attributes:
        frequency_hz: (f,).
        inner: (5, f) quantiles 5, 25, 50, 75, 95 % by coefficients and robot alone, m/s; nan where all diverged.
        outer: (5, f) with the twin's own error in speed as well.
    """

    frequency_hz: np.ndarray
    inner: np.ndarray
    outer: np.ndarray


@dataclass(frozen=True, eq=False)
class PredictedTrial:
    """One trial beside what the posterior predicts of it.

    Attributes:
        name, role: of the trial.
        speed: measured smooth forward speed, m/s.
        inner, outer: (5,) quantiles 5, 25, 50, 75, 95 % of the predicted one, m/s.
        place_m: (m,) of each marker along the body.
        swing_m: (m,) measured amplitude of its lateral beat at the crank's frequency.
        swing_inner, swing_outer: (5, m) quantiles of the predicted ones.
        inside: share of the gait's harmonics within the outer 90 % band; means do not count, boxes set them.
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
    inside: float

    @property
    def speed_inside(self) -> bool:
        """Whether the measured speed lies within the outer 90 % band."""
        return bool(self.outer[0] <= self.speed <= self.outer[-1])


def some_draws(posterior: Posterior, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """(d, 5) coefficients and (d, 2) discrepancies, drawn without replacement."""
    rows = random.choice(len(posterior.coefficients), min(count, len(posterior.coefficients)), replace=False)
    return posterior.coefficients[rows], posterior.discrepancy[rows]


def predict_sweep(posterior: Posterior, twin: Twin, frequency_hz: np.ndarray, seed: int = 0) -> PredictedSweep:
    """Simulates draws at each frequency (f,), started at the speed that the posterior median reaches."""
    random = np.random.default_rng([seed, 3])
    coefficients, discrepancy = some_draws(posterior, DRAWS, random)
    middle = np.array([posterior.median])
    start = steady_speed(twin, middle, frequency_hz, np.full(len(frequency_hz), START_SPEED_M_S))[0]
    start = np.nan_to_num(start, nan=START_SPEED_M_S)

    def speeds(twin: Twin, coefficients: np.ndarray) -> np.ndarray:
        return steady_speed(twin, coefficients, frequency_hz, start)

    speed = at_vanishing_step(speeds, twin, coefficients)  # (d, f)
    slopes = [each.per_sd * (speeds(each.more, middle) - speeds(each.less, middle))[0] for each in _doubted(posterior)]
    if slopes:
        robot = SharedNuisances.of(posterior).drawn(coefficients, random)[:, -len(slopes) :]  # (d, r)
        speed = speed + robot @ np.array(slopes)
    off = 1 + discrepancy[:, None, 1:] * random.standard_normal((len(speed), 1, _NOISES))
    outer = (speed[..., None] * off).transpose(0, 2, 1).reshape(-1, len(frequency_hz))
    return PredictedSweep(frequency_hz, _quantiles(speed), _quantiles(outer))


def steady_speed(twin: Twin, coefficients: np.ndarray, frequency_hz: np.ndarray, start_m_s: np.ndarray) -> np.ndarray:
    """(d, f) forward speed after some beats of sets of coefficients (d, 5), m/s; nan where the twin diverged.

    Args:
        twin: with nose and neck among its markers.
        coefficients: (d, 5).
        frequency_hz: (f,) of the crank.
        start_m_s: (f,) forward speed at the beginning.
    """
    sets, speeds = len(coefficients), []
    for hz, start in zip(frequency_hz, start_m_s, strict=True):
        time_s = np.arange(0.0, max((_SETTLING_BEATS + _BEATS) / hz, _LEAST_S), _FRAME_S)
        runs = Runs(coefficients, np.full(sets, hz), np.zeros(sets), np.tile([-start, 0.0, 0.0], (sets, 1)))
        markers = twin.simulate(runs, time_s, allow_divergence=True).marker_m
        forward_m = to_head_frame(markers, twin.markers.index("nose"), twin.markers.index("neck")).forward_m
        speeds.append(forward_speed(time_s, forward_m, time_s >= _SETTLING_BEATS / hz, float(hz)))
    return np.stack(speeds, axis=1)


def predict_trials(
    posterior: Posterior, trials: Sequence[MeasuredTrial], twin: Twin, seed: int = 0
) -> tuple[PredictedTrial, ...]:
    """Each trial beside draws from the posterior, fit and held-out ones."""
    random = np.random.default_rng([seed, 4])
    coefficients, discrepancy = some_draws(posterior, DRAWS, random)
    drawn = _Drawn(coefficients, discrepancy, SharedNuisances.of(posterior).drawn(coefficients, random))
    fitted = {model.trial.name: model for model in posterior.model.trials}
    models = [fitted.get(trial.name) or _held_out(trial, twin, _doubted(posterior)) for trial in trials]
    return tuple(_predict(model, posterior, drawn, random) for model in models)


class _Drawn(NamedTuple):
    """(d, 5) coefficients, (d, 2) discrepancies and (d, q) nuisances that all trials share, drawn together."""

    coefficients: np.ndarray
    discrepancy: np.ndarray
    shared: np.ndarray


def _doubted(posterior: Posterior) -> tuple[DoubtedTwin, ...]:
    return posterior.model.trials[0].doubted


def _held_out(trial: MeasuredTrial, twin: Twin, doubted: tuple[DoubtedTwin, ...]) -> TrialModel:
    """With the frequency of its own first beats, whose error is a nuisance like any other."""
    return TrialModel(twin, replace(trial, frequency=trial.start_frequency), START_PHASE_RAD, doubted)


def _predict(model: TrialModel, posterior: Posterior, drawn: _Drawn, random: np.random.Generator) -> PredictedTrial:
    gaits = at_vanishing_step(
        lambda twin, coefficients: replace(model, twin=twin).simulated(coefficients), model.twin, drawn.coefficients
    )  # (d, k)
    freedoms = model.freedoms(np.array(posterior.median))
    gaits = gaits + drawn.shared @ freedoms.shared(posterior.found.off.marker_m).T
    good = np.isfinite(gaits).all(axis=1)
    gaits, discrepancy = gaits[good], drawn.discrepancy[good]
    place_m = model.twin.robot.marker_positions_m(model.trial.markers)[:, 0]
    columns = np.hstack([freedoms.in_step, posterior.found.off.box_m * freedoms.boxes])
    known = _root(model.noise_covariance + columns @ columns.T)
    wave = _root(wave_discrepancy(np.median(gaits, axis=0), place_m))
    around = [
        gait[None]
        + random.standard_normal((_NOISES, len(gait))) @ known
        + wave_off * random.standard_normal((_NOISES, len(gait))) @ wave
        + speed_off * gait[SPEED] * np.eye(len(gait))[SPEED] * random.standard_normal((_NOISES, 1))
        for gait, (wave_off, speed_off) in zip(gaits, discrepancy, strict=True)
    ]
    outer = np.concatenate(around)
    low, high = np.quantile(outer, [0.05, 0.95], axis=0)
    waves = _is_wave(len(low))
    return PredictedTrial(
        name=model.trial.name,
        role=model.trial.role,
        speed=float(model.measured[SPEED]),
        inner=_quantiles(gaits[:, SPEED]),
        outer=_quantiles(outer[:, SPEED]),
        place_m=place_m - place_m.min(),
        swing_m=_swing(model.measured),
        swing_inner=_quantiles(_swing(gaits)),
        swing_outer=_quantiles(_swing(outer)),
        inside=float(((model.measured >= low) & (model.measured <= high))[waves].mean()),
    )


def _swing(gait: np.ndarray) -> np.ndarray:
    """(..., m) amplitude of each marker's lateral beat."""
    return np.abs(harmonics_of(gait)[..., 1, 0])


def _is_wave(length: int) -> np.ndarray:
    """(k,) which numbers of a gait belong to harmonics."""
    places = np.arange(length) - SPEED - 1
    return (places >= 0) & (places % OF_A_MARKER != 0)


def _root(covariance: np.ndarray) -> np.ndarray:
    """(k, k) that makes white rows correlated."""
    values, vectors = np.linalg.eigh(covariance)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def _quantiles(values: np.ndarray) -> np.ndarray:
    """(5, ...) over the first axis, diverged ones left out."""
    lost = np.isnan(values).all(axis=0)
    return np.where(lost, np.nan, np.nanquantile(np.where(lost, 0.0, values), QUANTILES, axis=0))
