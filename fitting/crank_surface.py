"""Error of dry runs over crank arm, speed and phase: the published search for each run, and the joint fit of all.

Published search (`error_surface`, `lowest_point`): mean marker distance on a grid of crank arm, speed and phase, its
best cells refined. "Simple Models, Real Swimming" (2026), identification of the dry robot: of all simulations on the
grid, the one whose markers stay closest to the measured ones over a fixed 4 s, head clamped, in the head frame. Here
phase costs no simulation (a shift in time of a turn that repeats) and speed hardly one (`fitting.dry_run`).

Joint fit (`fit_joint`): one crank arm for all dry runs, each with its own speed and phase, by generalised least
squares. The published distance takes nose and neck as they were marked. A box two pixels off its marker turns and
scales the head frame, and two per cent of scale are two per cent of the arm. Here every marker has an offset of its own
that lasts for the trial, drawn from one spread (a random effect; Patterson and Thompson 1971), and each trial has a
place, a heading and a scale of its own: the layout of all markers gives the scale, the motion about their means the
arm.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.ndimage import minimum_filter
from scipy.optimize import least_squares, minimize
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from fitting.dry_run import ANGLES, DryResponse, DryTrial
from fitting.frequency import standard_error
from swimcal.runs import workers_of

# The published search
ARM_SPAN = 0.25  # grid on either side of the robot's own arm, relative
SPEED_SPAN = 0.15  # grid on either side of the command, relative
FAR_FROM_BEAT = 0.3  # relative difference from which a command does not count
_MOST_FRAMES = 150  # frames of a trial that the grid reads, at most; its valleys are followed with all of them
_VALLEYS = 3  # valleys that are followed to their floors
_EVALUATIONS = 250  # evaluations in each, at most

# The joint fit
_ROUNDS = 3  # rounds of fit and noise level
_OWN = 6  # numbers a trial has to itself: speed, phase, place (2), turned scale (2)
_BLOCKS_PER_BEAT = 4.0  # blocks over which errors are summed to see how long they last
_DIFFERENCE = (2e-5, 1e-4, 1e-4)  # finite differences of arm (m), speed (Hz) and phase (rad)
OFFSET_M = (1e-4, 5e-3)  # a box is put on the marker it is for: more is the model's, and may not loosen the scale


# The published search, one run at a time.


@dataclass(frozen=True)
class CrankGrid:
    """Grid of the published search, by numbers of points.

    The default makes 102,060, as many in phase as divide the table's 180 angles.
    """

    arms: int = 21
    speeds: int = 81
    phases: int = 60

    def __post_init__(self) -> None:
        if ANGLES % self.phases:
            raise ValueError(f"phases: found {self.phases}, expected a divisor of {ANGLES}")


class Cell(NamedTuple):
    """A point of a surface: arm (m), speed (turns a second), phase (rad), mean marker distance (m)."""

    arm_m: float
    hz: float
    phase_rad: float
    distance_m: float


@dataclass(frozen=True, eq=False)
class ErrorSurface:
    """The published distance of one trial on the grid.

    Attributes:
        arm_m: (a,) m.
        hz: (s,) turns a second.
        phase_rad: (p,) phase of the turn at time 0, from 0 to 2 pi.
        distance_m: (a, s, p) mean marker distance, m.
    """

    arm_m: np.ndarray
    hz: np.ndarray
    phase_rad: np.ndarray
    distance_m: np.ndarray

    @property
    def over_phase_m(self) -> np.ndarray:
        """Lowest distance over all phases, (a, s), m."""
        return self.distance_m.min(axis=2)

    @property
    def over_speed_m(self) -> np.ndarray:
        """Lowest distance over all speeds, (a, p), m."""
        return self.distance_m.min(axis=1)

    def valleys(self, most: int = 5) -> list[Cell]:
        """Return the cells that are lower than all their neighbours (phase is periodic), the deepest first."""
        lowest = minimum_filter(self.distance_m, size=3, mode=("nearest", "nearest", "wrap"))
        cells = [
            Cell(float(self.arm_m[i]), float(self.hz[j]), float(self.phase_rad[k]), float(self.distance_m[i, j, k]))
            for i, j, k in np.argwhere(self.distance_m == lowest)
        ]
        return sorted(cells, key=lambda cell: cell.distance_m)[:most]


def speed_range(trials: Sequence[DryTrial]) -> tuple[float, float]:
    """Return the range of speeds that holds beat and command of all trials, turns a second.

    A command far from its beat, which is flagged, does not count.
    """
    beats = [trial.frequency.hz for trial in trials]
    commands = [trial.commanded_hz or beat for trial, beat in zip(trials, beats, strict=True)]
    likely = [hz for hz, beat in zip(commands, beats, strict=True) if abs(hz / beat - 1) < FAR_FROM_BEAT]
    known = [*beats, *likely]
    return (1 - SPEED_SPAN) * min(known), (1 + SPEED_SPAN) * max(known)


def error_surface(trial: DryTrial, response: DryResponse, grid: CrankGrid, workers: int = 0) -> ErrorSurface:
    """Compute the published distance at every point of the grid: all simulated arms, speeds around command and beat.

    Args:
        trial: the dry run.
        response: the simulated motion of the tail.
        grid: the grid.
        workers: threads; 0 for all cores.
    """
    hz = np.linspace(*speed_range([trial]), grid.speeds)
    own = response.select(trial.markers)
    measured = _ScoredTrial.of(trial, own)

    def of_arm(i: int) -> np.ndarray:
        turns = np.tensordot(np.array([own.speed_weights(f) for f in hz]), own.marker_m[i], 1)  # (s, angles, m)
        return np.stack([measured.over_phases(turn, f, grid.phases) for turn, f in zip(turns, hz, strict=True)])

    with ThreadPoolExecutor(workers_of(workers) or os.cpu_count()) as pool:
        distance = np.stack(list(pool.map(of_arm, range(len(own.arm_m)))))
    return ErrorSurface(own.arm_m, hz, 2 * np.pi * np.arange(grid.phases) / grid.phases, distance)


def in_head_frame(marker_m: np.ndarray, markers: tuple[str, ...]) -> np.ndarray:
    """Return model markers (..., m) relative to the nose; the clamped head already points along -x."""
    nose = markers.index("nose")
    return marker_m - marker_m[..., nose : nose + 1]


def lowest_point(trial: DryTrial, response: DryResponse, surface: ErrorSurface) -> Cell:
    """Find the lowest point of a surface by following its deepest valleys to their floors (Nelder and Mead 1965).

    A valley beyond a snap of the tail, where nothing is interpolated, stays at its cell.

    Args:
        trial: the dry run.
        response: the simulated motion of the tail.
        surface: the published distance on the grid.
    """
    own = response.select(trial.markers)
    return min(
        (_refine(trial, own, surface, cell) for cell in surface.valleys(_VALLEYS)), key=lambda cell: cell.distance_m
    )


def distance_at(trial: DryTrial, response: DryResponse, arm_m: float, hz: float, phase_rad: float) -> float:
    """Return the published distance at a point between those of the grid, m.

    It is the mean over the trusted samples of the scored 4 s.

    Args:
        trial: the dry run.
        response: the simulated motion of the trial's markers.
        arm_m: crank arm, m.
        hz: turns a second.
        phase_rad: phase of the turn at time 0.
    """
    turn = response.turn(arm_m, hz, response.branch_at(arm_m))
    model = in_head_frame(turn.at(phase_rad + 2 * np.pi * hz * trial.even_s), trial.markers)
    weight = trial.head_weight[trial.scored]
    distance = np.abs(np.where(weight > 0, trial.head_m[trial.scored] - model[trial.scored], 0.0))
    return float((weight * distance).sum() / weight.sum())


@dataclass(frozen=True, eq=False)
class _ScoredTrial:
    """The part of a trial that a grid needs: k of its frames, t markers behind the head, in single precision."""

    trial: DryTrial
    even_s: np.ndarray  # (k,)
    place: np.ndarray  # (2, k, 1, t)
    weight: np.ndarray  # (k, t), all samples of the trial adding up to 1
    head_m: float  # what the head's own markers, which the grid does not move, add to the mean distance

    @classmethod
    def of(cls, trial: DryTrial, response: DryResponse) -> "_ScoredTrial":
        tail, scored = list(trial.tail), np.flatnonzero(trial.scored)
        scored = scored[:: -(-len(scored) // _MOST_FRAMES)]
        weight = trial.head_weight[scored]
        weight = weight / weight.sum()
        measured = np.where(weight > 0, trial.head_m[scored], 0.0)  # (k, m)
        still = in_head_frame(response.marker_m[0, 0, 0], trial.markers)  # (m,)
        front = [i for i in range(len(trial.markers)) if i not in tail]
        head = float((weight * np.abs(measured - still))[:, front].sum())
        behind = measured[:, None, tail]
        place = np.stack([behind.real, behind.imag]).astype(np.float32)
        return cls(trial, trial.even_s[scored], place, weight[:, tail].astype(np.float32), head)

    def over_phases(self, turn: np.ndarray, hz: float, phases: int) -> np.ndarray:
        """Return the distance at each phase (p,), m, for one turn (angles, m).

        Between two angles the tail moves straight.
        """
        behind = in_head_frame(turn, self.trial.markers)[:, list(self.trial.tail)]
        table = np.stack([behind.real, behind.imag]).astype(np.float32)  # (2, angles, t)
        along = ANGLES * ((hz * self.even_s) % 1.0)
        first = np.floor(along).astype(int)
        rows = (first[:, None] + np.arange(phases) * (ANGLES // phases)) % ANGLES  # (k, p)
        share = (along - first).astype(np.float32)[:, None, None]
        step = np.roll(table, -1, axis=1) - table
        off = table[:, rows] + share * step[:, rows] - self.place  # (2, k, p, t)
        return self.head_m + np.einsum("kt,kpt->p", self.weight, np.sqrt(off[0] ** 2 + off[1] ** 2), optimize=True)


def _refine(trial: DryTrial, response: DryResponse, surface: ErrorSurface, cell: Cell) -> Cell:
    low, high = response.range_of(response.branch_at(cell.arm_m))
    if not low <= cell.arm_m <= high:
        return cell
    steps = np.array([np.ptp(axis) / max(len(axis) - 1, 1) for axis in (surface.arm_m, surface.hz, surface.phase_rad)])
    middle = trial.even_s[trial.scored].mean()  # phase counted from here hardly depends on the speed

    def point(x: np.ndarray) -> tuple[float, float, float]:
        hz = cell.hz + steps[1] * x[1]
        turned = 2 * np.pi * middle * (hz - cell.hz)
        return cell.arm_m + steps[0] * x[0], hz, cell.phase_rad + steps[2] * x[2] - turned

    bounds = [
        ((low - cell.arm_m) / steps[0], (high - cell.arm_m) / steps[0]),
        tuple((surface.hz[[0, -1]] - cell.hz) / steps[1]),
        (-10.0, 10.0),
    ]
    simplex = np.vstack([np.zeros(3), np.diag([-1.0 if cell.arm_m >= high else 1.0, 1.0, 1.0])])
    found = minimize(
        lambda x: distance_at(trial, response, *point(x)),
        np.zeros(3),
        method="Nelder-Mead",
        bounds=bounds,
        options={"initial_simplex": simplex, "maxfev": _EVALUATIONS, "xatol": 1e-3, "fatol": 1e-8},
    )
    arm_m, hz, phase_rad = map(float, point(found.x))
    return Cell(arm_m, hz, phase_rad % (2 * np.pi), float(found.fun))


# The joint fit of one arm to all runs.


class Spread(NamedTuple):
    """Standard deviations in each coordinate, m: of a marker's lasting offset, and of one frame's error as if white."""

    offset_m: float = 2e-3
    frame_m: float = 2e-3


class JointTrial(NamedTuple):
    """A trial's share of the joint fit.

    Attributes:
        hz, hz_se: turns of the crank a second, with standard error.
        phase_rad, phase_se_rad: phase of the even turn at time 0, with standard error.
        scale: scale of the picture by all markers, over that of the measured nose-neck distance.
        motion_error_m: root mean square distance between the markers' motions about their means, m.
    """

    hz: float
    hz_se: float
    phase_rad: float
    phase_se_rad: float
    scale: float
    motion_error_m: float


class JointFit(NamedTuple):
    """Joint fit: the arm that all trials share, m, its standard error, and what each trial has to itself."""

    arm_m: float
    arm_se_m: float
    branch: int
    trials: tuple[JointTrial, ...]


def fit_joint(trials: Sequence[DryTrial], response: DryResponse, starts: Sequence[Cell]) -> JointFit:
    """Fit arm, speeds and phases to all frames of all trials; the arm starts at the median of the starts.

    Args:
        trials: the dry runs.
        response: the simulated motion of the tail.
        starts: a start of each trial's search.
    """
    arm_m = float(np.median([start.arm_m for start in starts]))
    branch = response.branch_at(arm_m)
    parts = [_Part(trial, response.select(trial.markers), branch, Spread()) for trial in trials]
    arm_m = float(np.clip(arm_m, *response.range_of(branch)))
    own = np.array([[s.hz, s.phase_rad + 2 * np.pi * s.hz * p.middle_s] for s, p in zip(starts, parts, strict=True)])
    point = np.concatenate([[arm_m], own.ravel()])
    with threadpool_limits(1, user_api="blas"):  # the matrices are small: threads cost more than they save
        for _ in range(_ROUNDS):
            point = _solve(parts, response, branch, point)
            parts = _update_spreads(parts, point)
        return _with_errors(parts, branch, point)


@dataclass(frozen=True, eq=False)
class _Part:
    """A trial and the tail's motion; its phase is counted at the middle of the trial, apart from its speed."""

    trial: DryTrial
    response: DryResponse
    branch: int
    spread: Spread

    @property
    def middle_s(self) -> float:
        return float(self.trial.even_s.mean())

    def model(self, arm_m: float, hz: float, middle_rad: float) -> np.ndarray:
        """Return the markers (n, m) in the robot frame, m."""
        turn = self.response.turn(arm_m, hz, self.branch)
        return turn.at(middle_rad + 2 * np.pi * hz * (self.trial.even_s - self.middle_s))

    def split(self, series: np.ndarray) -> np.ndarray:
        """Split a series (n, m) into residuals about its means and the means, each over its spread, (n m + m,)."""
        mean, about = self.about_mean(series)
        return np.concatenate([about.ravel() / self.spread.frame_m, mean / self.spread.offset_m])

    def about_mean(self, series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the weighted means (m,), 0 for a marker never seen, and root-weighted residuals (n, m)."""
        weight = self.trial.weight
        values = np.where(weight > 0, series, 0.0)
        mean = (weight * values).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-12)
        return mean, np.sqrt(weight) * (values - mean)

    def pose(self, model: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the place and turned scale (2,) that lay the model onto the tracks, and the residuals (n m + m,)."""
        columns = np.column_stack([self.split(np.ones(model.shape, complex)), self.split(model)])
        tracks = self.split(self.trial.place_m)
        pose = np.linalg.solve(columns.conj().T @ columns, columns.conj().T @ tracks)
        return pose, tracks - columns @ pose

    def slopes(self, point: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Return the derivatives (n m + m, 7) of the tracks by arm, speed, phase, place (2), turned scale (2)."""
        model = self.model(*point)
        shifts = np.diag(_DIFFERENCE)
        moved = [pose[1] * (self.model(*(point + s)) - self.model(*(point - s))) / (2 * s.sum()) for s in shifts]
        ones = np.ones(model.shape, complex)
        return np.column_stack([self.split(column) for column in (*moved, ones, 1j * ones, model, 1j * model)])


def _points(point: np.ndarray) -> list[np.ndarray]:
    return [np.array([point[0], hz, phase]) for hz, phase in point[1:].reshape(-1, 2)]


def _solve(parts: list[_Part], response: DryResponse, branch: int, point: np.ndarray) -> np.ndarray:
    def errors(x: np.ndarray) -> np.ndarray:
        residuals = [part.pose(part.model(*p))[1] for part, p in zip(parts, _points(x), strict=True)]
        return np.concatenate(residuals).view(float)

    low, high = response.range_of(branch)
    slowest, fastest = response.hz[0], response.hz[-1]
    bounds = np.array([(low, high)] + [(slowest, fastest), (-np.inf, np.inf)] * len(parts)).T
    scale = np.array([1e-3] + [1e-2, 1e-1] * len(parts))
    start = np.clip(point, *bounds)
    return least_squares(errors, start, bounds=bounds, x_scale=scale, xtol=1e-10, ftol=1e-10, diff_step=1e-6).x


def _update_spreads(parts: list[_Part], point: np.ndarray) -> list[_Part]:
    """Return the parts with spreads re-estimated from the errors.

    The spread of the offsets is one for all trials, that of the frames one for each.
    """
    residuals = [_residual(part, p) for part, p in zip(parts, _points(point), strict=True)]
    means = [part.about_mean(residual)[0] for part, residual in zip(parts, residuals, strict=True)]
    freedom = _freedom(parts)
    offset = np.sqrt(sum(float((np.abs(mean) ** 2).sum()) for mean in means) / freedom)
    offset = float(np.clip(offset, *OFFSET_M))
    whites = map(_as_if_white, parts, residuals)
    return [replace(part, spread=Spread(offset, white)) for part, white in zip(parts, whites, strict=True)]


def _freedom(parts: list[_Part]) -> int:
    """Return the degrees of freedom: offsets seen, two a marker, less the four of each trial's pose."""
    seen = [int((part.trial.weight > 0).any(axis=0).sum()) for part in parts]
    return max(sum(2 * count - 4 for count in seen), 1)


def _residual(part: _Part, point: np.ndarray) -> np.ndarray:
    """Return the tracks less the posed model, (n, m), m."""
    model = part.model(*point)
    pose = part.pose(model)[0]
    return np.where(part.trial.weight > 0, part.trial.place_m - pose[0] - pose[1] * model, 0.0)


def _as_if_white(part: _Part, residual: np.ndarray) -> float:
    """Return the spread of white errors whose sums over a quarter of a beat would vary as much as these do."""
    about = part.about_mean(residual)[1]
    beats = part.trial.frequency.hz * np.ptp(part.trial.time_s)
    length = max(round(len(about) / (beats * _BLOCKS_PER_BEAT)), 1)
    root = np.sqrt(part.trial.weight)
    starts = np.arange(0, len(about), length)
    sums, weights = np.add.reduceat(root * about, starts), np.add.reduceat(root**2, starts)
    variance = (np.abs(sums) ** 2).sum() / max(float(weights.sum()), 1e-12) / 2
    return max(float(np.sqrt(variance)), 1e-6)


def _with_errors(parts: list[_Part], branch: int, point: np.ndarray) -> JointFit:
    points = _points(point)
    poses = [part.pose(part.model(*p))[0] for part, p in zip(parts, points, strict=True)]
    slopes = [part.slopes(p, pose) for part, p, pose in zip(parts, points, poses, strict=True)]
    pulls = _pulls(slopes)  # (r, 1 + 6 t) complex rows
    residuals = [_residual(part, p) for part, p in zip(parts, points, strict=True)]
    freedom = _freedom(parts)

    def error(combination: np.ndarray) -> float:
        """Return the standard error of a linear combination of the fitted numbers."""
        rows = np.split(pulls @ combination, np.cumsum([len(s) for s in slopes])[:-1])
        variances = [_variance(p, r, own, freedom) for p, r, own in zip(parts, residuals, rows, strict=True)]
        return float(np.sqrt(sum(variances)))

    units = np.eye(1 + _OWN * len(parts))
    found = []
    for i, (part, p, pose) in enumerate(zip(parts, points, poses, strict=True)):
        speed, phase = units[1 + _OWN * i], units[2 + _OWN * i]
        back = 2 * np.pi * part.middle_s  # turn between the middle of the trial and time 0
        at_start = float((p[2] - back * p[1]) % (2 * np.pi))
        about = part.about_mean(residuals[i])[1]
        motion = float(np.sqrt((np.abs(about) ** 2).sum() / part.trial.weight.sum()))
        errors = (error(speed), error(phase - back * speed))
        found.append(JointTrial(float(p[1]), errors[0], at_start, errors[1], float(abs(pose[1])), motion))
    return JointFit(float(point[0]), error(units[0]), branch, tuple(found))


def _pulls(slopes: list[np.ndarray]) -> np.ndarray:
    """Return how much each split row of all trials moves each number (r, 1 + 6 t): the arm, then six of every trial."""
    whole = np.column_stack(
        [np.concatenate([own[:, 0] for own in slopes]), block_diag(*[own[:, 1:] for own in slopes])]
    )
    information = (whole.conj().T @ whole).real
    size = np.sqrt(np.diag(information)) + 1e-300
    inverse = np.linalg.pinv(information / np.outer(size, size), hermitian=True) / np.outer(size, size)
    return whole @ inverse


def _variance(part: _Part, residual: np.ndarray, rows: np.ndarray, freedom: int) -> float:
    """Return a trial's share of the variance of a number on which its split rows pull: motion and offsets."""
    n, m = residual.shape
    weight = part.trial.weight
    pull = rows[: n * m].reshape(n, m) / part.spread.frame_m
    slope = np.where(weight > 0, pull / np.sqrt(np.where(weight > 0, weight, 1.0)), 0.0)
    both = np.concatenate([slope.real, slope.imag], axis=1)  # (n, 2 m)
    errors = np.concatenate([residual.real, residual.imag], axis=1)
    twice = np.concatenate([weight, weight], axis=1)
    curvature = float((twice * both**2).sum())
    per_beat = n / max(part.trial.frequency.hz * float(np.ptp(part.trial.time_s)), 1.0)
    motion = standard_error(np.ones((n, 1)), both, errors, twice, per_beat) * curvature if curvature > 0 else 0.0
    few = student.ppf(0.975, freedom) / 1.96  # so that twice the error holds 95 % although the spread is estimated
    return float(motion**2 + few**2 * (np.abs(rows[n * m :]) ** 2).sum())
