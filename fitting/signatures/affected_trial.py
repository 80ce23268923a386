"""One trial beside a twin with effects."""

from dataclasses import dataclass

import numpy as np

from fitting.posterior.trial_model import TrialModel
from swimmer import Runs
from swimmer.effects import AffectedRuns, AffectedTwin, View


@dataclass(frozen=True, eq=False)
class AffectedTrial:
    """What effects do to the gait of one trial.

    Attributes:
        model: the trial beside the plain twin.
        twin: the same twin with effects.
        view: of the trial.
    """

    model: TrialModel
    twin: AffectedTwin
    view: View

    def gaits(self, coefficients: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(s, k) gaits of coefficients (s, 5) and values (s, p) of the session; nan where the twin diverged."""
        return self.model.in_step(self.model.gait(self._seen(self._runs(coefficients, values))))

    def hertz(self, values: np.ndarray) -> np.ndarray:
        """(s,) the frequency that the trial's command leads to with values (s, p), as it is measured; nan without one.

        What gears and clocks make of the command, and how a crank that does not turn evenly beats over the trial.
        """
        trial = self.model.trial
        if trial.commanded_hz is None:
            return np.full(len(values), np.nan)
        led_to = np.array([self.twin.measured_hz(trial.commanded_hz, value) for value in values])
        if trial.turn is not None:
            return led_to
        runs = self._runs(np.zeros((len(values), 5)), values)
        return np.asarray(led_to + self.twin.beats_hz(runs, trial.time_s) - trial.frequency.hz)

    def _runs(self, coefficients: np.ndarray, values: np.ndarray) -> AffectedRuns:
        trial, count = self.model.trial, len(values)
        return AffectedRuns(
            coefficients=np.ascontiguousarray(coefficients),
            frequency_hz=np.full(count, trial.frequency.hz),
            phase_rad=np.full(count, self.model.phase_rad),
            velocity=np.tile(trial.start_velocity, (count, 1)),
            turns=None if trial.turn is None else (trial.turn.shifted(0.0, 1.0),) * count,
            values=np.array([self.twin.in_trial(self.view, value) for value in values]),
        )

    def _seen(self, runs: Runs) -> np.ndarray:
        """(s, n, m, 2) the kept frames, scaled by nose and neck as tracks are."""
        trial = self.model.trial
        last = int(np.flatnonzero(trial.kept)[-1]) + 1
        told = self.twin.simulate(runs, trial.time_s[:last], allow_divergence=True)
        seen = self.twin.observed(runs, told, [self.view] * len(runs))
        nose, neck = (trial.markers.index(name) for name in ("nose", "neck"))
        span = np.median(np.linalg.norm(seen[:, :, nose] - seen[:, :, neck], axis=-1), axis=1)
        scale = self.twin.robot.scale_length_m / span
        return np.compress(trial.kept[:last], scale[:, None, None, None] * seen, axis=1)
