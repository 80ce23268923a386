"""One trial beside a twin with effects."""

from dataclasses import dataclass

import numpy as np

from fitting.model.trial_model import TrialModel
from swimmer import Trajectories
from swimmer.effects import AffectedRuns, AffectedTwin, View


@dataclass(frozen=True, eq=False)
class AffectedTrial:
    """What effects do to the features of one trial.

    Attributes:
        model: the trial beside the plain twin.
        twin: the same twin with effects.
        view: of the trial.
    """

    model: TrialModel
    twin: AffectedTwin
    view: View

    def hertz(self, values: np.ndarray) -> np.ndarray:
        """(s,) the frequency that the trial's command leads to with values (s, p), as it is measured; nan without one.

        What gears and clocks make of the command, and how a crank that does not turn evenly beats over the trial.
        """
        trial = self.model.trial
        if trial.commanded_hz is None:
            return np.full(len(values), np.nan)
        led_to = np.array([self.twin.measured_hz(trial.commanded_hz, value) for value in values])
        return led_to + self._otherwise_hz(values)

    def logged_hz(self, values: np.ndarray) -> np.ndarray:
        """(s,) the frequency that the trial's command leads to with values (s, p), as the motor's log tells it.

        What makes a crank that does not turn evenly beat otherwise over the trial shows there too; a twin beside a
        wrong clock beats as it was filmed.
        """
        trial = self.model.trial
        assert trial.commanded_hz is not None
        led_to = np.array([self.twin.turned_hz(trial.commanded_hz, value) for value in values])
        return led_to + self._otherwise_hz(values)

    def _otherwise_hz(self, values: np.ndarray) -> np.ndarray:
        """(s,) what an uneven turn of the crank adds to how the tail beats; 0 beside a measured turn."""
        trial = self.model.trial
        if trial.turn is not None:
            return np.zeros(len(values))
        runs = self.runs(np.zeros((len(values), 5)), values)
        return np.asarray(self.twin.beats_hz(runs, trial.time_s) - trial.frequency.hz)

    def runs(self, coefficients: np.ndarray, values: np.ndarray) -> AffectedRuns:
        """Of coefficients (s, 5) and values (s, p) of the session."""
        trial, count = self.model.trial, len(values)
        return AffectedRuns(
            coefficients=np.ascontiguousarray(coefficients),
            frequency_hz=np.full(count, trial.frequency.hz),
            phase_rad=np.full(count, self.model.phase_rad),
            velocity=np.tile(trial.start_velocity, (count, 1)),
            turns=None if trial.turn is None else (trial.turn.shifted(0.0, 1.0),) * count,
            values=np.array([self.twin.in_trial(self.view, value) for value in values]),
        )

    def features(self, runs: AffectedRuns, told: Trajectories) -> np.ndarray:
        """(s, k) of its runs, as tracks would show them, scaled by nose and neck; nan where the twin diverged."""
        trial = self.model.trial
        seen = self.twin.observed(runs, told, [self.view] * len(runs))
        nose, neck = (trial.markers.index(name) for name in ("nose", "neck"))
        span = np.median(np.linalg.norm(seen[:, :, nose] - seen[:, :, neck], axis=-1), axis=1)
        scaled = (self.twin.robot.scale_length_m / span)[:, None, None, None] * seen
        kept = np.compress(trial.kept[: len(self.model.time_s)], scaled, axis=1)
        return self.model.in_step(self.model.reader(kept))
