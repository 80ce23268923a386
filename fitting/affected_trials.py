"""Trials of a session as a twin with effects swims them and the camera sees them.

All trials are simulated together (`AffectedSession`) and seen by the camera that filmed them (`view_of`). A step with
forces that no model holds costs by the step, hardly by the simulation. `imagined` films a trial that could still be
swum.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fitting.measure_trial import measure_trial
from fitting.ring import Ring, ring_changes
from fitting.session_model import SessionModel
from fitting.trial import MeasuredTrial
from fitting.trial_model import TrialModel, trajectories_together
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.effect import Effect, View
from swimcal.runs import Runs, Trajectories
from swimcal.session import TrialSpec
from swimcal.session_file import CameraCalibration, CameraSpec
from swimcal.tracks import as_tracks
from swimcal.twin import Twin, simulate_together

# Pictures
COMMON_PX = (
    (640, 480),
    (1280, 720),
    (1920, 1080),
    (1920, 1440),
    (2704, 1520),
    (2704, 2028),
    (3840, 2160),
    (5312, 2988),
)
"""Sizes of the pictures of common cameras, width and height; the smallest comes first."""
_RUN_IN_BEATS = 4.0  # beats of an imagined trial in which the speed settles
TO_PX = np.array([1.0, -1.0])  # the pool's y points up in the picture


def picture_px(trials: Iterable[MeasuredTrial], camera: CameraSpec) -> tuple[float, float]:
    """Return the width and height of the picture: as calibrated, else the least common size that holds all tracks."""
    if (lens := camera.calibration) is not None:
        return lens.width_px, lens.height_px
    reached = np.max([np.nanmax(TO_PX * each.position_m / each.metres_per_px, axis=(0, 1)) for each in trials], axis=0)
    holding = [size for size in COMMON_PX if (reached < size).all()]
    return holding[0] if holding else (float(reached[0]), float(reached[1]))


def with_picture(camera: CameraSpec, trials: Iterable[MeasuredTrial]) -> CameraSpec:
    """Return the camera with the picture that all trials of a session tell, so that all its parts share the same one.

    It serves views alone: its focal length is only a placeholder.
    """
    if camera.calibration is not None:
        return camera
    width, height = (round(size) for size in picture_px(trials, camera))
    picture = CameraCalibration(
        width_px=width, height_px=height, fx_px=width, fy_px=width, cx_px=width / 2, cy_px=height / 2
    )
    return replace(camera, calibration=picture)


def view_of(
    trial: MeasuredTrial,
    simulated_m: np.ndarray,
    camera: CameraSpec,
    size_px: tuple[float, float] | None = None,
) -> View:
    """Return the view of a trial; without a calibrated lens its axis goes through the middle of the picture.

    The twin's frame is laid on the pool so that both fish, over the kept frames, head the same way and are at the same
    place in the mean: at a single frame each is somewhere else in its beat.

    Args:
        trial: the measured trial.
        simulated_m: (n, m, 2) the twin's markers in the kept frames, m.
        camera: the camera that filmed it.
        size_px: size of the picture; default: as the trial alone tells it.
    """
    width_px, height_px = size_px or picture_px([trial], camera)
    lens = camera.calibration
    middle_px = np.array([width_px / 2, height_px / 2] if lens is None else [lens.cx_px, lens.cy_px])
    measured_m = trial.position_m[trial.kept][: len(simulated_m)]
    (line, place), (own_line, own_place) = (_mean_head(each, trial.markers) for each in (measured_m, simulated_m))
    turn = np.angle(line / own_line)
    cos, sin = np.cos(turn), np.sin(turn)
    to_pool = np.array([[cos, -sin], [sin, cos]])  # turns the twin's frame into the pool's
    origin_m = place - to_pool @ own_place
    return View(
        axis_m=(trial.metres_per_px * TO_PX * middle_px - origin_m) @ to_pool,
        down=np.array([0.0, -1.0]) @ to_pool,
        half_height_m=height_px / 2 * trial.metres_per_px,
    )


def _mean_head(position_m: np.ndarray, markers: tuple[str, ...]) -> tuple[complex, np.ndarray]:
    """Return the mean direction from nose to neck, x + i y, and the mean place (2,) of the nose.

    The positions are (n, m, 2).
    """
    nose, neck = (position_m[:, markers.index(name)] for name in ("nose", "neck"))
    line = (neck - nose) / np.linalg.norm(neck - nose, axis=-1, keepdims=True)
    along, across = np.nanmean(line, axis=0)
    return complex(along, across), np.asarray(np.nanmean(nose, axis=0))


def imagined(
    twin: Twin,
    like: MeasuredTrial,
    coefficients: np.ndarray,
    hz: float,
    start_m_s: float,
    seconds: float,
    noise: Callable[[np.ndarray], np.ndarray | float] = lambda _time_s: 0.0,
    middle_px: np.ndarray | float = 0.0,
) -> MeasuredTrial:
    """Simulate a trial that could be swum, settled at a frequency, filmed like another of the same markers.

    Args:
        twin: the twin that swims it.
        like: the other trial.
        coefficients: (5,) of the twin.
        hz: turns of the crank a second.
        start_m_s: forward speed that it begins with.
        seconds: time that is filmed.
        noise: (n, m, 2) of the tracks at times (n,), m; default: none.
        middle_px: (2,) middle of the picture.
    """
    frame_s, run_in_s = float(np.median(np.diff(like.time_s))), _RUN_IN_BEATS / hz
    time_s = np.arange(0.0, run_in_s + seconds, frame_s)
    runs = Runs(coefficients[None], np.array([hz]), np.zeros(1), np.array([[-start_m_s, 0.0, 0.0]]))
    marker_m = twin.simulate(runs, time_s).marker_m[0]
    position_px = (marker_m - marker_m.mean(axis=(0, 1)) + noise(time_s)) / like.metres_per_px * TO_PX + middle_px
    tracks = as_tracks(like.markers, time_s, position_px, np.ones(position_px.shape[:2]))
    spec = TrialSpec(f"{hz:.2f} Hz", "swim", commanded_hz=hz, role="fit")
    later = tracks.isel(time=slice(int(np.searchsorted(time_s, run_in_s)), None))
    camera = CameraSpec(1 / frame_s, twin.robot.scale_length_m)
    return measure_trial(spec, later, camera, twin.robot, like.warmup_s, judged=False)


@dataclass(frozen=True, eq=False)
class AffectedTrial:
    """One trial and the twin with effects, to compute its features."""

    model: TrialModel
    twin: AffectedTwin
    view: View

    def hertz(self, values: np.ndarray, *, logged: bool = False) -> np.ndarray:
        """Return the frequency (s,) that the trial's command leads to with values (s, p); nan without a command.

        It is as measured by the camera or, if `logged`, by the motor's log: the effect of gears and clocks on the
        command, and the mean over the trial of a crank that does not turn evenly, unless its turn was measured. That
        shows in a log too; a twin with a wrong clock beats as it was filmed.
        """
        trial = self.model.trial
        if trial.commanded_hz is None:
            return np.full(len(values), np.nan)
        led_to = self.twin.turned_hz if logged else self.twin.measured_hz
        found = np.array([led_to(trial.commanded_hz, value) for value in values])
        if trial.turn is not None:
            return found
        runs = self.runs(np.zeros((len(values), 5)), values)
        return np.asarray(found + self.twin.beats_hz(runs, trial.time_s) - trial.frequency.hz)

    def runs(self, coefficients: np.ndarray, values: np.ndarray) -> AffectedRuns:
        """Return the runs of the trial.

        Args:
            coefficients: (s, 5).
            values: (s, p) values of the session.
        """
        in_trial = np.array([self.twin.in_trial(self.view, value) for value in values])
        return AffectedRuns(**vars(self.model.runs(coefficients)), values=in_trial)

    def features(self, runs: AffectedRuns, motion: Trajectories) -> np.ndarray:
        """Return the features (s, k) of its runs, as tracks would show them, scaled by nose and neck.

        They are nan where the twin diverged.
        """
        return self.model.in_step(self.model.reader(self._tracked(runs, motion)))

    def creeps(self, motion: Trajectories, values: np.ndarray) -> np.ndarray:
        """Return how much faster markers slide aside of their neighbours with values (s, p), (s, m) m/s.

        Only what is seen of the plain twin's motion counts: no bend makes a marker slide aside.

        Args:
            motion: the plain twin's.
            values: (s, p) of all effects.
        """
        every = np.vstack([np.zeros((1, values.shape[1])), values])
        runs, again = self.runs(np.zeros((len(every), 5)), every), np.zeros(len(every), int)
        found = self.model.creeps(self._tracked(runs, motion.part(again, motion.marker_m.shape[1])))
        return np.asarray(found[1:] - found[0])

    def _tracked(self, runs: AffectedRuns, motion: Trajectories) -> np.ndarray:
        """Return the markers (s, n, m, 2) in the kept frames, as tracks would show them."""
        tracked = self.twin.tracked(runs, motion, self.view)
        return np.compress(self.model.trial.kept[: len(self.model.time_s)], tracked, axis=1)


@dataclass(frozen=True, eq=False)
class AffectedSession:
    """A session with twins that have effects, to compute its rows.

    Attributes:
        trials: the t trials, each with a twin that has the same effects; equal twins are simulated together.
        motions: how the plain twin swims those that tell whether markers slide aside; of all trials, or of none.
        logged: numbers of those whose motor was logged.
        rings: free decays of the same robot.
    """

    trials: tuple[AffectedTrial, ...]
    motions: tuple[Trajectories, ...] = ()
    logged: tuple[int, ...] = ()
    rings: tuple[Ring, ...] = ()

    @classmethod
    def of(
        cls, effects: Sequence[Effect], model: SessionModel, camera: CameraSpec, coefficients: np.ndarray
    ) -> "AffectedSession":
        """Build the session, with views from the plain twins at given coefficients.

        Args:
            effects: the effects.
            model: the trials.
            camera: the camera that filmed them.
            coefficients: (5,).
        """
        twins = {id(each.twin): AffectedTwin(each.twin, effects) for each in model.trials}
        at = tuple(map(float, coefficients))
        trials = zip(model.trials, views_of(model, camera, at), strict=True)
        affected = tuple(AffectedTrial(each, twins[id(each.twin)], view) for each, view in trials)
        return cls(affected, _plain_motions(model, at) if model.of_creeps else (), model.logged, model.rings)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects, with the parameters that these trials' markers give them."""
        return self.trials[0].twin.effects

    def features(self, coefficients: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return rows of features (s, k); nan where the twin diverged.

        Args:
            coefficients: (s, 5).
            values: (s, p) values of all effects.
        """
        runs, times = [trial.runs(coefficients, values) for trial in self.trials], [t.model.time_s for t in self.trials]
        swims = simulate_together([trial.twin for trial in self.trials], runs, times)
        return np.hstack([trial.features(own, each) for trial, own, each in zip(self.trials, runs, swims, strict=True)])

    def hertz(self, values: np.ndarray) -> np.ndarray:
        """Return the frequencies (s, f) that the trials' commands lead to with values (s, p); nan without a command.

        First come those of all trials as they are filmed, then those of the motors' logs.
        """
        filmed = [trial.hertz(values) for trial in self.trials]
        return np.column_stack([*filmed, *(self.trials[number].hertz(values, logged=True) for number in self.logged)])

    def beside(self, values: np.ndarray) -> np.ndarray:
        """Return the change (s, b) by values (s, p) of the numbers after the features; 0 where nobody knows.

        They are those of frequencies, of markers that slide aside, which only what is seen of a swim does, and of free
        decays: there only effects act that can show in one.
        """
        twin = self.trials[0].twin.plain
        hertz = self.hertz(np.vstack([np.zeros((1, values.shape[1])), values]))
        return np.hstack(
            [
                np.nan_to_num(hertz[1:] - hertz[0]),
                *self._creeps(values),
                *(ring_changes(ring, twin, self.effects, values) for ring in self.rings),
            ]
        )

    def _creeps(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the change (s, m) by values (s, p) of how fast markers slide aside, trial by trial."""
        trials = zip(self.trials, self.motions, strict=bool(self.motions))
        if any("observe" in effect.enters() for effect in self.effects):
            return [trial.creeps(motion, values) for trial, motion in trials]
        return [np.zeros((len(values), len(trial.model.trial.markers))) for trial, _ in trials]


@lru_cache(maxsize=8)
def _plain_motions(model: SessionModel, coefficients: tuple[float, ...]) -> tuple[Trajectories, ...]:
    """Return how the plain twin swims each trial at coefficients (5,)."""
    return tuple(trajectories_together(model.trials, np.array([coefficients])))


@lru_cache(maxsize=8)
def views_of(model: SessionModel, camera: CameraSpec, coefficients: tuple[float, ...]) -> tuple[View, ...]:
    """Return the view of each trial of a session, one picture for all.

    Args:
        model: the trials.
        camera: the camera that filmed them.
        coefficients: (5,) of the plain twin.
    """
    size = picture_px([each.trial for each in model.trials], camera)
    swum = zip(model.trials, _plain_motions(model, coefficients), strict=True)
    return tuple(view_of(each.trial, each.positions_in(motion)[0], camera, size) for each, motion in swum)


@lru_cache(maxsize=8)
def plain_features(model: SessionModel, camera: CameraSpec, coefficients: tuple[float, ...]) -> np.ndarray:
    """Return the row of features (k,) without any effect, which is that of every effect of no strength.

    Args:
        model: the trials.
        camera: the camera that filmed them.
        coefficients: (5,) of the plain twin.
    """
    at = np.array([coefficients])
    return AffectedSession.of((), model, camera, at[0]).features(at, np.zeros((1, 0)))[0]
