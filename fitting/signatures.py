"""Signatures of effects: how what a session measured would change with an effect.

A twin with effects swims the trials of a session, all simulated together (`AffectedSession`), and is seen by the camera
that filmed them (`view_of`). A step with forces that no model holds costs by the step, hardly by the simulation.
`imagined` films a trial that could still be swum.

What a session measured is one row: the features of all swims, then the differences of their frequencies from the
commands, and then the numbers of free decays (`residual_row`, `row_slopes`, `row_covariance`). In the space `Whitened`
all that disturbs a row has unit size.

A `Signature` is the change of the row at a few strengths of an effect. The change over the strength, the slope of a
chord, is taken to be right about that strength (`pieces`). Nearer to zero the slope goes on as it changes from the
other side of zero, or, for a parameter with one sign, as it changes beyond; where it changes only across zero it has a
kink there, and stays.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from fitting.covariance import apart
from fitting.decay_fit import Ring, ring_changes
from fitting.trial import MeasuredTrial, measure_trial
from fitting.trial_model import SessionModel, TrialModel
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.effect import Effect, View
from swimcal.mjcf import COEFFICIENT_BOUNDS
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

# Rows
PRIOR_SD = np.full(5, (COEFFICIENT_BOUNDS[1] - COEFFICIENT_BOUNDS[0]) / np.sqrt(12.0))
TOLD_TO = 0.002  # relative standard deviation of a measured frequency about the commanded one
_ALIKE = 0.8  # correlation of the errors of tail and motor's log: both do what the motor does
_LEAST = 0.01  # least coefficient for the Jacobian: nearer to 0 steps are lost in the twin's roughness
_STEP = 0.02  # finite difference of the root of a coefficient, either way
LONG = 10.0
"""Whitened norm of a step after which the Jacobian is simulated anew."""

# Signatures
STRENGTHS = (-3.0, -1.0, 1.0, 3.0)  # standard deviations of a parameter's prior
_LITTLE = 0.3  # share of the least strength tried at which the slope of small strengths is taken


# The camera that films the twin.


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
    return measure_trial(spec, later, CameraSpec(1 / frame_s, twin.robot.scale_length_m), twin.robot, like.warmup_s)


# Trials swum by a twin with effects.


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
        tracked = self.twin.tracked(runs, motion, self.view)
        kept = np.compress(self.model.trial.kept[: len(self.model.time_s)], tracked, axis=1)
        return self.model.in_step(self.model.reader(kept))


@dataclass(frozen=True, eq=False)
class AffectedSession:
    """A session with twins that have effects, to compute its rows.

    Attributes:
        trials: the t trials, each with a twin that has the same effects; equal twins are simulated together.
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
        """Build the session, with views from the plain twins at given coefficients.

        Args:
            effects: the effects.
            model: the trials.
            camera: the camera that filmed them.
            coefficients: (5,).
        """
        twins = {id(each.twin): AffectedTwin(each.twin, effects) for each in model.trials}
        views = views_of(model, camera, tuple(map(float, coefficients)))
        trials = zip(model.trials, views, strict=True)
        affected = tuple(AffectedTrial(each, twins[id(each.twin)], view) for each, view in trials)
        return cls(affected, model.logged, model.rings)

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

        They are those of frequencies, and of free decays: there only effects act that can show in one.
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
    """Return the view of each trial of a session, one picture for all.

    Args:
        model: the trials.
        camera: the camera that filmed them.
        coefficients: (5,) of the plain twin.
    """
    size, at = picture_px([each.trial for each in model.trials], camera), np.array([coefficients])
    return tuple(view_of(each.trial, each.positions(at)[0], camera, size) for each in model.trials)


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


# The row, and the space in which its disturbances have unit size.


def residual_row(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """Return the residual (k + b,) of the features, and of the numbers after them.

    The residual of frequencies is their difference from the commands, Hz: first those of all tails, as filmed, then
    those of the motors that were logged; and then of free decays.

    Args:
        model: the session.
        at: (5,) coefficients of the twin.
    """
    residual = model.measured - model.simulated(at[None])[0]
    trials = [each.trial for each in model.trials]
    hertz = [0.0 if trial.commanded_hz is None else trial.filmed_hz - trial.commanded_hz for trial in trials]
    logged = [_off_command(trials[number]) for number in model.logged]
    return np.concatenate([residual, hertz, logged, model.ring_residuals])


def row_slopes(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """Return the Jacobian (k + b, 5) of the row by the coefficients, on which only features depend.

    Its steps are even in the roots of the coefficients.

    Args:
        model: the session.
        at: (5,) coefficients of the twin.
    """
    roots = np.sqrt(np.maximum(at, _LEAST)) + _STEP * np.vstack([np.eye(5), -np.eye(5)])
    points = np.clip(roots, 0.0, np.sqrt(COEFFICIENT_BOUNDS[1])) ** 2
    features = model.simulated(points)
    slopes = (features[:5] - features[5:]) / np.diag(points[:5] - points[5:])[:, None]
    return np.vstack([slopes.T, np.zeros((model.beside, 5))])


def row_covariance(model: SessionModel, features: np.ndarray, robot: np.ndarray | None = None) -> np.ndarray:
    """Return the covariance (k + b, k + b) of a row; frequencies are as far off their commands as motors are.

    Args:
        model: the swims.
        features: (k, k) covariance of all that disturbs them.
        robot: (k, q) effect of the robot's uncertain numbers on features, which decays have in common with them;
            default: nothing.
    """
    whose = [*range(len(model.trials)), *model.logged]
    hertz = np.diag([TOLD_TO * model.trials[number].trial.frequency.hz for number in whose])
    correlation = np.where(np.equal.outer(whose, whose), _ALIKE, 0.0) + (1 - _ALIKE) * np.eye(len(whose))
    doubted = model.ring_sensitivities
    told = apart(features, model.observed)
    whole = block_diag(told, hertz @ correlation @ hertz, np.diag(model.rings_sd**2) + doubted @ doubted.T)
    if robot is not None and robot.shape[1] == doubted.shape[1]:  # else it is not doubted yet
        shared = robot @ doubted.T
        whole[: len(features), len(whole) - len(doubted) :] = shared
        whole[len(whole) - len(doubted) :, : len(features)] = shared.T
    return np.asarray(whole)


@dataclass(frozen=True, eq=False)
class Whitened:
    """A space in which all that disturbs a session's row of k numbers has unit size and coefficients are free.

    The row holds the features of t trials, and then the numbers after them.

    Attributes:
        root: (k, k) lower Cholesky factor of the covariance of noise, nuisances and the twin's own discrepancy.
        slopes: (k, 5) Jacobian of the row by the coefficients.
        precision: (5,) precision of the prior of the coefficients.
    """

    root: np.ndarray
    slopes: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, slopes: np.ndarray, prior_sd: np.ndarray) -> "Whitened":
        """Build the space.

        Args:
            covariance: (k, k) of the row.
            slopes: (k, 5) Jacobian of the row by the coefficients.
            prior_sd: (5,) standard deviations of the prior of the coefficients.
        """
        return cls(np.linalg.cholesky(covariance), slopes, prior_sd**-2.0)

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (..., k) whitened, less what coefficients can explain, (..., k + 5); norms are distances."""
        white = solve_triangular(self.root, rows.reshape(-1, rows.shape[-1]).T, lower=True)  # (k, q)
        slopes = np.vstack([solve_triangular(self.root, self.slopes, lower=True), np.diag(np.sqrt(self.precision))])
        white = np.vstack([white, np.zeros((len(self.precision), white.shape[1]))])
        residual = white - slopes @ np.linalg.lstsq(slopes, white, rcond=None)[0]
        return residual.T.reshape(*rows.shape[:-1], -1)

    @cached_property
    def log_volume(self) -> float:
        """Part of the logarithm of a row's density besides half the square of its norm, up to a constant."""
        white = solve_triangular(self.root, self.slopes, lower=True)
        freedom = np.diag(self.precision) + white.T @ white
        of_prior = 0.5 * float(np.log(self.precision).sum())
        return of_prior - float(np.log(np.diag(self.root)).sum()) - 0.5 * float(np.linalg.slogdet(freedom)[1])

    def coefficients(self, row: np.ndarray) -> np.ndarray:
        """Return the change (5,) of coefficients that best makes up for a change (k,) of the row.

        The prior holds it back.
        """
        white, slopes = (solve_triangular(self.root, part, lower=True) for part in (row, self.slopes))
        return np.linalg.solve(slopes.T @ slopes + np.diag(self.precision), slopes.T @ white)

    def length(self, row: np.ndarray) -> float:
        """Return the norm of a change (k,) of the row after coefficients are refitted."""
        return float(np.linalg.norm(self.projected(row)))


def _off_command(trial: MeasuredTrial) -> float:
    assert trial.logged_hz is not None
    assert trial.commanded_hz is not None
    return trial.logged_hz - trial.commanded_hz


# The signature of an effect.


@dataclass(frozen=True, eq=False)
class Signature:
    """Signature of one effect on trials whose features form a row of length k, followed by b further numbers.

    Attributes:
        effect: the effect, with the parameters that these trials' markers give it.
        values: (q, p) strengths that were tried.
        features: (q, k) change of the row of features; nan where the twin diverged.
        beside: (q, b) change of what the trials' commands lead to, as filmed and as logged, Hz, and of how decays ring.
    """

    effect: Effect
    values: np.ndarray
    features: np.ndarray
    beside: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """Changes of the whole row, (q, k + b)."""
        return np.hstack([self.features, self.beside])


def signature_of(
    effect: Effect,
    model: SessionModel,
    camera: CameraSpec,
    coefficients: np.ndarray,
    values: np.ndarray | None = None,
) -> Signature:
    """Compute the signature of an effect on the trials of a session, against the plain twin.

    An effect of no strength is the plain twin (see `Effect`): one that is not would have a part that never changes.

    Args:
        effect: the effect, of the catalogue or of a user.
        model: the trials with the plain twin.
        camera: the camera that filmed them.
        coefficients: (5,) of the twin.
        values: (q, p) strengths; by default each parameter alone, one and three standard deviations of its prior either
            way, as far as its bounds allow.
    """
    session = AffectedSession.of([effect], model, camera, coefficients)
    suited = session.effects[0]
    values = strengths(suited) if values is None else values
    plain = plain_features(model, camera, tuple(map(float, coefficients)))
    rows = (
        session.features(np.tile(coefficients, (len(values), 1)), values) if len(values) else np.zeros((0, len(plain)))
    )
    return Signature(suited, values, rows - plain, session.beside(values))


def strengths(effect: Effect) -> np.ndarray:
    """Return the strengths to try (q, p): each parameter alone, in sizes `STRENGTHS` as far as its bounds allow."""
    rows = []
    for number, parameter in enumerate(effect.parameters):
        for size in STRENGTHS:
            value = float(np.clip(size * parameter.sd, parameter.low, parameter.high))
            if value != 0.0:
                rows.append(value * np.eye(len(effect.parameters))[number])
    return np.unique(rows, axis=0) if rows else np.zeros((0, len(effect.parameters)))


class Piece(NamedTuple):
    """Slope of an effect over one stretch of strengths.

    Attributes:
        low, high: ends of the stretch, of its sign or zero, in the unit of the parameter.
        slope: (k,) change of the row over the strength; m, m/s or Hz for one of that unit.
    """

    low: float
    high: float
    slope: np.ndarray


def pieces(signature: Signature, parameter: int) -> tuple[Piece, ...]:
    """Return the pieces of all strengths of one parameter that its bounds allow, the lowest first.

    There is none where the twin diverged at every strength.

    Args:
        signature: the signature.
        parameter: number of the parameter.
    """
    bounds = signature.effect.parameters[parameter]
    tried = _chord_slopes(signature, parameter)
    found: list[Piece] = []
    for sign, end in ((-1.0, bounds.low), (1.0, bounds.high)):
        own = {sign * value: slope for value, slope in tried.items() if sign * value > 0}
        other = {-sign * value: slope for value, slope in tried.items() if sign * value < 0}
        if sign * end <= 0:
            continue
        if own:
            side = _side(own, other, sign * end)
        elif other:  # it diverged on this side: as on the other
            side = [Piece(0.0, sign * end, _about_zero(other, own))]
        else:
            continue
        found += side if sign > 0 else [Piece(-piece.high, -piece.low, piece.slope) for piece in side]
    return tuple(sorted(found, key=lambda piece: piece.low))


def little(signature: Signature, parameter: int) -> np.ndarray | None:
    """Return the slope of small strengths (k,), averaged over both signs.

    Args:
        signature: the signature.
        parameter: number of the parameter.

    Returns:
        None where the twin diverged at every strength.
    """
    near = [piece.slope for piece in pieces(signature, parameter) if piece.low <= 0 <= piece.high]
    return np.asarray(np.mean(near, axis=0)) if near else None


def _side(own: dict[float, np.ndarray], other: dict[float, np.ndarray], end: float) -> list[Piece]:
    """Return the pieces of one side, strengths counted from zero."""
    sizes = sorted(own)
    slopes = [_about_zero(own, other), *(own[size] for size in sizes)]
    places = [_LITTLE * sizes[0], *sizes]
    edges = [0.0, *(min(float(np.sqrt(a * b)), end) for a, b in pairwise(places)), end]
    found = (Piece(low, high, slope) for (low, high), slope in zip(pairwise(edges), slopes, strict=True))
    return [piece for piece in found if piece.low < piece.high]


def _about_zero(own: dict[float, np.ndarray], other: dict[float, np.ndarray]) -> np.ndarray:
    """Return the slope of small strengths on one side, (k,)."""
    sizes = sorted(own)
    first = own[sizes[0]]
    beyond = own[sizes[1]] - first if len(sizes) > 1 else None
    way = (1 - _LITTLE) * sizes[0]
    if other:
        across = first - other[min(other)]
        if beyond is None:
            share = 1.0
        else:
            expected = float(np.linalg.norm(across)) * (sizes[1] - sizes[0]) / (sizes[0] + min(other))
            share = min(float(np.linalg.norm(beyond)) / max(expected, 1e-300), 1.0)
        return np.asarray(first - share * across * way / (sizes[0] + min(other)))
    if beyond is None:
        return first
    return np.asarray(first - beyond * way / (sizes[1] - sizes[0]))


def _chord_slopes(signature: Signature, parameter: int) -> dict[float, np.ndarray]:
    """Return the slope of each chord by strength, for this parameter alone, where the twin did not diverge."""
    found = {}
    for values, row in zip(signature.values, signature.rows, strict=True):
        strength = float(values[parameter])
        if strength and np.isfinite(row).all() and np.count_nonzero(values) == 1:
            found[strength] = row / strength
    return found
