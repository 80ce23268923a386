"""The middle of a rough floor: where the objective is lowest once the roughness of the twin is averaged out.

Kutta lift roughens the objective, so that its floor holds many minima a few thousandths of a millimetre apart in height
but several per cent apart in the coefficients. A search stops in those it meets first and so leans to where it came
from. Here the errors are taken as linear over a cloud as wide as the noise could move the best, by regression, and the
minimum of that is what one would find on average.
"""

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.objective import Swims
from fitting.precision import covariance
from fitting.search_space import SearchSpace, parameters
from swimmer import FluidCoefficients

_CLOUD = 40  # points, each with its mirror image among them
_STEPS = 10  # of Gauss-Newton on the linear errors, which cost no simulation


def middle_of_floor(swims: Swims, fit: CoefficientFit, rounds: int = 3, seed: int = 0) -> FluidCoefficients:
    """The coefficients in the middle of the floor around a fit; up to 1 % further from the tracks than the best.

    Meant for what the coefficients are read for: on tracks made by the twin itself they are free of the lean that the
    best has. Where the twin is far from the tracks (33 mm on the public ones) the cloud is wide, and it means little.

    Args:
        swims: the fit trials and the twin.
        fit: of them.
        rounds: of a cloud around the last middle, 40 simulations of the trials each.
        seed: of the cloud.
    """
    space, point = SearchSpace(swims), fit.restarts[0].point
    values, vectors = np.linalg.eigh(covariance(space, point))
    half = np.random.default_rng(seed).normal(size=(space.size, _CLOUD // 2))
    cloud = vectors @ (np.sqrt(np.abs(values))[:, None] * np.hstack([half, -half]))
    for _ in range(rounds):
        point = _middle(space, point, cloud)
    return FluidCoefficients(*map(float, parameters(point)[:5]))


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
