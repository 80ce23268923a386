"""The best cells of the published search, refined: the lowest mean marker distance between the points of the grid."""

import numpy as np
from scipy.optimize import minimize

from fitting.dry_run.error_surface import Cell, ErrorSurface, in_head_frame, published_distance
from fitting.dry_run.measured import DryTrial
from fitting.dry_run.response import DryResponse

_EVALUATIONS, _VALLEYS = 250, 3


def lowest_point(trial: DryTrial, response: DryResponse, surface: ErrorSurface) -> Cell:
    """The lowest point of a surface: its deepest valleys, each followed to its floor (Nelder and Mead 1965).

    A valley beyond a snap of the tail, where nothing is interpolated, stays at its cell.
    """
    own = response.select(trial.markers)
    return min(
        (_refined(trial, own, surface, cell) for cell in surface.valleys(_VALLEYS)), key=lambda cell: cell.distance_m
    )


def distance_at(trial: DryTrial, response: DryResponse, arm_m: float, hz: float, phase_rad: float) -> float:
    """The published distance of a point between those of the grid, m; `response` holds the trial's markers."""
    turn = response.turn(arm_m, hz, response.branch_at(arm_m))
    model = in_head_frame(turn.at(phase_rad + 2 * np.pi * hz * trial.even_s), trial.markers)
    return published_distance(trial, model)


def _refined(trial: DryTrial, response: DryResponse, surface: ErrorSurface, cell: Cell) -> Cell:
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
