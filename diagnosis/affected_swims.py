"""Marker errors and speeds of a twin with effects at fixed values, in the numbers that readers know."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from diagnosis.linear_model import LinearModel
from fitting.forecast import fit_phase, forecast, score
from fitting.model.session_model import START_PHASE_RAD
from fitting.model.trial_model import TrialModel
from fitting.signatures.affected_session import view_of
from fitting.speed import forward_speed
from fitting.trial import MeasuredTrial
from swimmer import FluidCoefficients, Runs, Trajectories
from swimmer.effects import AffectedRuns, AffectedTwin, Effect, View

_DRAWS = 8


class ForecastScore(NamedTuple):
    """Scores of one trial against a twin that runs ahead on its own.

    Attributes:
        name: name of the trial.
        marker_error_m: marker error of the public contract, m.
        speed_measured, speed_twin: forward speeds, m/s.
    """

    name: str
    marker_error_m: float
    speed_measured: float
    speed_twin: float


class SettledTwin(AffectedTwin):
    """A twin with effects at given values, seen by the camera of one trial: it simulates what tracks would show.

    Args:
        twin: the twin with the effects.
        values: (p,) values of the effects, in the session's frame.
        view: the camera of the trial.
    """

    def __init__(self, twin: AffectedTwin, values: np.ndarray, view: View) -> None:
        super().__init__(twin.plain, twin.effects)
        self._settled, self._view = np.asarray(values, float), view

    def simulate(self, runs: Runs, time_s: np.ndarray, *, allow_divergence: bool = False) -> Trajectories:
        """Simulate what tracks would show: with the effects, and scaled by nose and neck."""
        values = np.tile(self.in_trial(self._view, self._settled), (len(runs), 1))
        own = AffectedRuns(**vars(runs), values=values)
        simulated = super().simulate(own, time_s, allow_divergence=allow_divergence)
        return replace(simulated, marker_m=self.tracked(own, simulated, self._view))


def forecast_scores(
    linear: LinearModel, trials: Sequence[MeasuredTrial], effects: Sequence[Effect], at: np.ndarray, values: np.ndarray
) -> list[ForecastScore]:
    """Score a twin with effects against trials; frequency and phase are those of each trial.

    Args:
        linear: the linearised model, with twin and camera.
        trials: the trials to score.
        effects: the effects.
        at: (5,) coefficients.
        values: (p,) values of the effects.
    """
    found, coefficients = [], FluidCoefficients(*map(float, at))
    for trial in trials:
        plain = TrialModel(linear.twin, trial, START_PHASE_RAD).positions(linear.at[None])[0]
        view = view_of(trial, plain, linear.camera)
        twin = SettledTwin(AffectedTwin(linear.twin, effects), values, view) if effects else linear.twin
        head = forecast(twin, trial, coefficients, fit_phase(twin, trial, coefficients))
        speed = float(forward_speed(trial.time_s, head, trial.kept, trial.frequency.hz))
        found.append(ForecastScore(trial.name, score(trial, head).marker_error_m, trial.speed, speed))
    return found


def noise_floor_m(linear: LinearModel, number: int, seed: int = 0) -> float:
    """Return the mean marker distance that tracking noise alone makes of one swim, as in the public contract, m.

    A swim of the twin is scored against itself with noise like that of the trial on it, several times.

    Args:
        linear: the linearised model.
        number: number of the trial in it.
        seed: seed of the noise.
    """
    model, random = linear.model.trials[number], np.random.default_rng([seed, 17, number])
    trial, found = model.trial, []
    clean_m = linear.twin.simulate(model.runs(linear.at[None]), trial.time_s).marker_m[0]
    for _ in range(_DRAWS):
        noisy_m = clean_m + model.noise.drawn(trial.time_s, random)
        frames = [trial.seen_head(each) for each in (clean_m, noisy_m)]
        found.append(score(trial.seen_as(head=frames[1]), frames[0]).marker_error_m)
    return float(np.mean(found))
