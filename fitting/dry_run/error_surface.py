"""The published search: mean marker distance on a grid of crank arm, speed and phase, its best cells refined.

"Simple Models, Real Swimming" (2026), identification of the dry robot: of all simulations on the grid, the one whose
markers stay closest to the measured ones over a fixed 4 s, head clamped, in the head frame. Here phase costs no
simulation (a shift in time of a turn that repeats) and speed hardly one (`fitting.dry_run.response`).
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import minimum_filter
from scipy.optimize import minimize

from fitting.dry_run.measured import DryTrial
from fitting.dry_run.response import ANGLES, DryResponse
from swimmer.workers import workers_of

ARM_SPAN = 0.25  # grid on either side of the robot's own arm, relative
SPEED_SPAN = 0.15  # grid on either side of the command, relative
FAR_FROM_BEAT = 0.3  # relative difference from which a command does not count
_VALLEYS = 3  # valleys that are followed to their floors
_EVALUATIONS = 250  # evaluations in each, at most


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


def published_distance(trial: DryTrial, model_m: np.ndarray) -> float:
    """Return the mean distance to a model over the trusted samples of the scored 4 s, m.

    Args:
        trial: the dry run, n frames.
        model_m: (n, m) markers of the model in the head frame, m.
    """
    weight = trial.head_weight[trial.scored]
    distance = np.abs(np.where(weight > 0, trial.head_m[trial.scored] - model_m[trial.scored], 0.0))
    return float((weight * distance).sum() / weight.sum())


def in_head_frame(marker_m: np.ndarray, markers: tuple[str, ...]) -> np.ndarray:
    """Return model markers (..., m) relative to the nose; the clamped head already points along -x."""
    nose = markers.index("nose")
    return marker_m - marker_m[..., nose : nose + 1]


@dataclass(frozen=True, eq=False)
class _ScoredTrial:
    """The part of a trial that the distance needs: k frames of the t markers behind the head, in single precision."""

    trial: DryTrial
    even_s: np.ndarray  # (k,)
    place: np.ndarray  # (2, k, 1, t)
    weight: np.ndarray  # (k, t), all samples of the trial adding up to 1
    head_m: float  # what the head's own markers, which the grid does not move, add to the mean distance

    @classmethod
    def of(cls, trial: DryTrial, response: DryResponse) -> "_ScoredTrial":
        tail, scored = list(trial.tail), trial.scored
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

    Args:
        trial: the dry run.
        response: the simulated motion of the trial's markers.
        arm_m: crank arm, m.
        hz: turns a second.
        phase_rad: phase of the turn at time 0.
    """
    turn = response.turn(arm_m, hz, response.branch_at(arm_m))
    model = in_head_frame(turn.at(phase_rad + 2 * np.pi * hz * trial.even_s), trial.markers)
    return published_distance(trial, model)


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
