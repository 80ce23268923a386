"""How the objective rises along each coefficient: which the data hold, and which can slide.

A profile lets all other parameters follow, to first order: at each value of one coefficient the others take the
Gauss-Newton step that best makes up for the change, and the objective is simulated there.
"""

from dataclasses import dataclass

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.objective import Swims
from fitting.search_space import ROOTS, SearchSpace, parameters

POINTS = 11


@dataclass(frozen=True, eq=False)
class CoefficientProfiles:
    """The mean marker distance along each coefficient.

    Attributes:
        value: (5, k) values of the coefficient.
        slice_m: (5, k) mean distance with all else held, m.
        profile_m: (5, k) mean distance with all else following, m; never above the slice.
        best_m: at the fit itself, m.
    """

    value: np.ndarray
    slice_m: np.ndarray
    profile_m: np.ndarray
    best_m: float


def profile_objective(swims: Swims, fit: CoefficientFit) -> CoefficientProfiles:
    """Profiles around a fit, over the whole range of each coefficient; denser near zero."""
    space, best = SearchSpace(swims), fit.restarts[0].point
    roots = np.linspace(ROOTS[0], ROOTS[1], POINTS)
    held = np.repeat(best[:, None], 5 * POINTS, axis=1)
    for i in range(5):
        held[i, i * POINTS : (i + 1) * POINTS] = roots
    errors = space.errors(best[:, None])
    slopes = space.slopes(best[:, None], errors)
    _, curvature = space.norm.grad_hess(errors, slopes)
    following = held.copy()
    for i in range(5):
        columns = slice(i * POINTS, (i + 1) * POINTS)
        others = np.delete(np.arange(space.size), i)
        response = -np.linalg.lstsq(curvature[np.ix_(others, others)], curvature[others, i], rcond=1e-8)[0]
        following[np.ix_(others, np.arange(5 * POINTS)[columns])] += np.outer(response, roots - best[i])
    following = np.clip(following, space.low[:, None], space.high[:, None])
    distances = swims.mean_distance(parameters(np.hstack([held, following])))
    sliced, followed = np.split(distances, 2)
    return CoefficientProfiles(
        value=np.tile(roots**2, (5, 1)),
        slice_m=sliced.reshape(5, POINTS),
        profile_m=np.minimum(sliced, followed).reshape(5, POINTS),
        best_m=fit.mean_distance_m,
    )
