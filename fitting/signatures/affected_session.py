"""All trials of a session beside twins with effects, simulated together.

A step with forces that no model holds costs by the step, hardly by the simulation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fitting.free_decay import Ring
from fitting.free_decay.ring import ring_changes
from fitting.model.session_model import SessionModel
from fitting.model.trial_model import TrialModel
from fitting.signatures.view_of import picture_px, view_of
from session import CameraSpec
from swimmer import Trajectories
from swimmer.effects import AffectedRuns, AffectedTwin, Effect, View
from swimmer.twin import simulate_together


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

    def features(self, runs: AffectedRuns, motion: Trajectories) -> np.ndarray:
        """(s, k) of its runs, as tracks would show them, scaled by nose and neck; nan where the twin diverged."""
        trial = self.model.trial
        seen = self.twin.observed(runs, motion, [self.view] * len(runs))
        nose, neck = (trial.markers.index(name) for name in ("nose", "neck"))
        span = np.median(np.linalg.norm(seen[:, :, nose] - seen[:, :, neck], axis=-1), axis=1)
        scaled = (self.twin.robot.scale_length_m / span)[:, None, None, None] * seen
        kept = np.compress(trial.kept[: len(self.model.time_s)], scaled, axis=1)
        return self.model.in_step(self.model.reader(kept))


@dataclass(frozen=True, eq=False)
class AffectedSession:
    """What effects do to the rows of a session.

    Attributes:
        trials: t of them, each beside a twin with the same effects; twins that are one object are simulated together.
        logged: numbers of those whose motor was logged.
        rings: free decays of the same robot.
    """

    trials: tuple[AffectedTrial, ...]
    logged: tuple[int, ...] = ()
    rings: tuple[Ring, ...] = ()

    @classmethod
    def of(
        cls, effects: Sequence[Effect], model: SessionModel, camera: CameraSpec, coefficients: np.ndarray
    ) -> "AffectedSession":
        """Seen as the plain twins of coefficients (5,) say."""
        twins = {id(each.twin): AffectedTwin(each.twin, effects) for each in model.trials}
        views = views_of(model, camera, tuple(map(float, coefficients)))
        trials = zip(model.trials, views, strict=True)
        affected = tuple(AffectedTrial(each, twins[id(each.twin)], view) for each, view in trials)
        return cls(affected, model.logged, model.rings)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """With the parameters that these trials' markers give them."""
        return self.trials[0].twin.effects

    def features(self, coefficients: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(s, k) rows of features of coefficients (s, 5) and values (s, p); nan where the twin diverged."""
        runs, times = [trial.runs(coefficients, values) for trial in self.trials], [t.model.time_s for t in self.trials]
        swims = simulate_together([trial.twin for trial in self.trials], runs, times)
        return np.hstack([trial.features(own, each) for trial, own, each in zip(self.trials, runs, swims, strict=True)])

    def hertz(self, values: np.ndarray) -> np.ndarray:
        """(s, f) frequencies that the trials' commands lead to with values (s, p); nan where there is no command.

        First as they are filmed, of all trials, then as the motors' logs tell them.
        """
        filmed = [trial.hertz(values) for trial in self.trials]
        return np.column_stack([*filmed, *(self.trials[number].logged_hz(values) for number in self.logged)])

    def beside(self, values: np.ndarray) -> np.ndarray:
        """(s, b) by how much values (s, p) change the numbers beside the features; 0 where nobody knows.

        Of frequencies, and of free decays: there act only effects that can show in one.
        """
        twin = self.trials[0].twin.plain
        hertz = self.hertz(np.vstack([np.zeros((1, values.shape[1])), values]))
        return np.hstack(
            [
                np.nan_to_num(hertz[1:] - hertz[0]),
                *(ring_changes(ring, twin, self.effects, values) for ring in self.rings),
            ]
        )


@lru_cache(maxsize=8)
def views_of(model: SessionModel, camera: CameraSpec, coefficients: tuple[float, ...]) -> tuple[View, ...]:
    """The view of each trial of a session, one picture for all."""
    size, at = picture_px([each.trial for each in model.trials], camera), np.array([coefficients])
    return tuple(view_of(each.trial, each.positions(at)[0], camera, size) for each in model.trials)


@lru_cache(maxsize=8)
def plain_features(model: SessionModel, camera: CameraSpec, coefficients: tuple[float, ...]) -> np.ndarray:
    """(k,) the row of features without any effect, which is that of every effect of no strength."""
    at = np.array([coefficients])
    return AffectedSession.of((), model, camera, at[0]).features(at, np.zeros((1, 0)))[0]
