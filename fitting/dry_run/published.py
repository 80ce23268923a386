"""The best cells of the published search, refined: the lowest mean marker distance between the points of the grid."""

import numpy as np
from scipy.optimize import minimize

from fitting.dry_run.error_surface import Cell, ErrorSurface, in_head_frame, published_distance
from fitting.dry_run.measured import DryTrial
from fitting.dry_run.response import DryResponse

AS_DEEP = 1.02  # a valley that is no higher than this times the deepest is as deep
_EVALUATIONS = 250


def refine_valleys(trial: DryTrial, response: DryResponse, surface: ErrorSurface, most: int = 3) -> tuple[Cell, ...]:
    """The valleys of a surface, each followed to its floor (Nelder and Mead 1965), the deepest first.

    A valley beyond a snap of the tail, where nothing is interpolated, stays at its cell.
    """
    own = response.select(trial.markers)
    found = [_refined(trial, own, surface, cell) for cell in surface.valleys(most)]
    return tuple(sorted(found, key=lambda cell: cell.distance_m))


def other_valley(valleys: tuple[Cell, ...], surface: ErrorSurface) -> Cell | None:
    """A second valley as deep as the deepest, more than two cells of the grid away from it."""
    best, *others = valleys
    steps = [float(np.diff(axis[:2])[0]) for axis in (surface.arm_m, surface.hz, surface.phase_rad)]
    for cell in others:
        turn = abs((cell.phase_rad - best.phase_rad + np.pi) % (2 * np.pi) - np.pi)
        away = (abs(cell.arm_m - best.arm_m), abs(cell.hz - best.hz), turn)
        if cell.distance_m <= AS_DEEP * best.distance_m and any(
            gap > 2 * step for gap, step in zip(away, steps, strict=True)
        ):
            return cell
    return None


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
