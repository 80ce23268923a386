"""The middle of a rough floor: where the objective is lowest once the roughness of the twin is averaged out.

Kutta lift roughens the objective, so that its floor holds many minima a few thousandths of a millimetre apart in height
but several per cent apart in the coefficients. A search stops in those it meets first and so leans to where it came
from. Here the errors are taken as linear over a cloud as wide as the noise could move the best, by regression, and the
minimum of that is what one would find on average.
"""

from dataclasses import replace

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.objective import Swims
from fitting.precision import covariance
from fitting.search_space import SearchSpace, parameters
from swimmer import FluidCoefficients

_CLOUD = 40  # points, each with its mirror image among them
_FAR_M = 0.01  # from the tracks: the twin, not the noise, makes the floor then
_AS_GOOD = 1.1  # objective of the middle over that of the best, at most
_ROUNDS = 3  # of a cloud around the last middle
_STEPS = 10  # of Gauss-Newton on the linear errors, which cost no simulation


def settled(swims: Swims, fit: CoefficientFit, seed: int = 0) -> CoefficientFit:
    """The fit in the middle of its floor, where that is as good; else the fit as it is.

    On tracks made by the twin itself the middle is free of the lean that the best has. Where the twin is far from the
    tracks (33 mm on the public ones) the cloud would be wide and mean little: such a fit stays. So does one whose
    middle is more than 10 % further from the tracks, or swims backward from rest.

    Args:
        swims: the fit trials and the twin.
        fit: of them.
        seed: of the cloud.
    """
    if fit.mean_distance_m > _FAR_M:
        return fit
    space = SearchSpace(swims)
    point = middle_of_floor(space, fit, seed)
    distance_m = float(swims.mean_distance(parameters(point)[:, None])[0])
    if distance_m > _AS_GOOD * fit.mean_distance_m or not space.swims_forward(point[:, None])[0]:
        return fit
    middle = FluidCoefficients(*map(float, parameters(point)[:5]))
    spent_s, evaluations = fit.spent_s + space.spent_s, fit.evaluations + space.evaluations
    return replace(
        fit,
        coefficients=middle,
        phase_rad=point[5:],
        mean_distance_m=distance_m,
        spent_s=spent_s,
        evaluations=evaluations,
        in_the_middle=True,
    )


def middle_of_floor(space: SearchSpace, fit: CoefficientFit, seed: int) -> np.ndarray:
    """(p,) the point in the middle of the floor around a fit.

    Args:
        space: the search space of the fit trials.
        fit: of them.
        seed: of the cloud.
    """
    point = fit.restarts[0].point
    values, vectors = np.linalg.eigh(covariance(space, point))
    half = np.random.default_rng(seed).normal(size=(space.size, _CLOUD // 2))
    cloud = vectors @ (np.sqrt(np.abs(values))[:, None] * np.hstack([half, -half]))
    for _ in range(_ROUNDS):
        point = _middle(space, point, cloud)
    return point


def _middle(space: SearchSpace, point: np.ndarray, cloud: np.ndarray) -> np.ndarray:
    """(p,) minimum of the objective with errors linear over a cloud (p, s) around a point (p,)."""
    points = np.clip(point[:, None] + cloud, space.low[:, None], space.high[:, None])
    design = np.column_stack([np.ones(points.shape[1]), (points - point[:, None]).T])  # (s, 1 + p)
    fitted = np.linalg.lstsq(design, space.errors(points).T, rcond=None)[0]
    errors, slopes = fitted[0][:, None], fitted[1:].T
    step = np.zeros((space.size, 1))
    for _ in range(_STEPS):
        gradient, curvature = space.norm.grad_hess(errors + slopes @ step, slopes)
        step -= np.linalg.lstsq(curvature, gradient, rcond=1e-10)[0]
    return np.clip(point + step[:, 0], space.low, space.high)
