"""Which further swim would narrow the coefficients most: a linear forecast of the posterior with one more trial.

At each frequency draws from the posterior swim. By how much their gaits move with the coefficients, and what would
disturb the measurement, says how a normal posterior would shrink (the linear Bayes rule; Chaloner and Verdinelli 1995).
"""

from dataclasses import dataclass, replace

import numpy as np

from fitting.model.discrepancy import wave_discrepancy
from fitting.model.features import SPEED
from fitting.model.noise import GaitNoise
from fitting.model.session_model import START_PHASE_RAD
from fitting.model.trial_model import TrialModel
from fitting.posterior.posterior import Posterior
from fitting.posterior.predictive import some_draws
from fitting.posterior.shared import SharedNuisances
from fitting.sweep import START_SPEED_M_S
from fitting.trial import MeasuredTrial, measure_trial
from session import CameraSpec, Tracks, TrialSpec
from swimmer import Runs, Twin

FREQUENCIES_HZ = np.linspace(0.4, 1.5, 12)
SECONDS = 5.0
_RUN_IN_BEATS = 4.0
_DRAWS = 24


@dataclass(frozen=True, eq=False)
class FurtherTrials:
    """One more swim of some seconds at each of several frequencies.

    Attributes:
        frequency_hz: (f,), the most telling first.
        sd: (f, 5) expected standard deviation of each coefficient with it.
        sd_now: (5,) without.
        wanted: (5,) the coefficients it is judged by: those that are not determined, or all.
    """

    frequency_hz: np.ndarray
    sd: np.ndarray
    sd_now: np.ndarray
    wanted: np.ndarray

    @property
    def shrinkage(self) -> np.ndarray:
        """(f,) by what factor the wanted standard deviations shrink, in geometric mean."""
        ratio = self.sd[:, self.wanted] / self.sd_now[self.wanted]
        return np.asarray(np.exp(np.log(ratio).mean(axis=1)))


def further_trials(posterior: Posterior, twin: Twin, seed: int = 0) -> FurtherTrials:
    """Judges swims that could still be made, measured like those of the session."""
    random = np.random.default_rng([seed, 5])
    coefficients = some_draws(posterior, _DRAWS, random)[0]
    covariance = SharedNuisances.of(posterior).with_coefficients()
    now = np.sqrt(np.diag(covariance))[:5]
    known = [_Further(posterior, _measured(posterior, twin, float(hz)), twin) for hz in FREQUENCIES_HZ]
    sd = np.array([np.sqrt(np.diag(one.narrowed(covariance, coefficients))) for one in known])
    determined = np.array([marginal.determined for marginal in posterior.marginals.values()])
    found = FurtherTrials(FREQUENCIES_HZ, sd, now, ~determined if not determined.all() else np.ones(5, bool))
    order = np.argsort(found.shrinkage)
    return replace(found, frequency_hz=FREQUENCIES_HZ[order], sd=sd[order])


class _Further:
    """One more trial, not yet made."""

    def __init__(self, posterior: Posterior, trial: MeasuredTrial, twin: Twin) -> None:
        doubted = posterior.model.trials[0].doubted
        self.posterior, self.model = posterior, TrialModel(twin, trial, START_PHASE_RAD, doubted)
        self.freedoms = self.model.freedoms(np.array(posterior.median))

    def narrowed(self, covariance: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """(5, 5) covariance of coefficients with the trial, from that (5 + q, 5 + q) without; shared nuisances last.

        Slopes are those over draws (d, 5).
        """
        gaits = self.model.simulated(coefficients)  # (d, k)
        good = np.isfinite(gaits).all(axis=1)
        x = coefficients[good] - coefficients[good].mean(axis=0)
        y = gaits[good] - gaits[good].mean(axis=0)
        slope = np.linalg.lstsq(x, y, rcond=None)[0]  # (5, k)
        left = y - x @ slope
        slope = np.vstack([slope, self.freedoms.shared(self.posterior.found.off.marker_m).T])  # (5 + q, k)
        disturbed = self._disturbed() + left.T @ left / max(len(left) - 6, 1)
        cross = covariance @ slope
        return np.asarray(covariance - cross @ np.linalg.solve(slope.T @ cross + disturbed, cross.T))[:5, :5]

    def _disturbed(self) -> np.ndarray:
        """(k, k) of the session's typical noise, the trial's own nuisances and the twin's discrepancy."""
        gait, freedoms = self.model.measured, self.freedoms
        wave, speed = np.median(self.posterior.discrepancy, axis=0)
        place_m = self.model.twin.robot.marker_positions_m(self.model.trial.markers)[:, 0]
        along = np.eye(len(gait))[SPEED] * gait[SPEED]
        return np.asarray(
            self._noise().covariance(self.model.gait)
            + freedoms.own @ freedoms.own.T
            + self.posterior.found.off.box_m**2 * freedoms.boxes @ freedoms.boxes.T
            + wave**2 * wave_discrepancy(gait, place_m)
            + speed**2 * np.outer(along, along)
        )

    def _noise(self) -> GaitNoise:
        return GaitNoise.typical([model.noise for model in self.posterior.model.trials], self.model.gait.time_s)


def _measured(posterior: Posterior, twin: Twin, hz: float) -> MeasuredTrial:
    """The twin at the posterior median, settled at a frequency and seen without noise."""
    like = posterior.model.trials[0].trial
    frame_s, run_in_s = float(np.median(np.diff(like.time_s))), _RUN_IN_BEATS / hz
    time_s = np.arange(0.0, run_in_s + SECONDS + like.warmup_s, frame_s)
    runs = Runs(
        np.array([posterior.median], float), np.array([hz]), np.zeros(1), np.array([[-START_SPEED_M_S, 0.0, 0.0]])
    )
    position_px = twin.simulate(runs, time_s).marker_m[0] / like.metres_per_px * np.array([1, -1])
    tracks = Tracks(like.markers, time_s, position_px, np.ones(position_px.shape[:2]))
    spec = TrialSpec(f"{hz:.2f} Hz", "swim", commanded_hz=hz, role="fit")
    camera = CameraSpec(1 / frame_s, twin.robot.scale_length_m)
    later = tracks.since(int(np.searchsorted(time_s, run_in_s)))
    return measure_trial(spec, later, camera, twin.robot, like.warmup_s)
