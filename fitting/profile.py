"""How the objective rises along each coefficient: which the data hold, and which can slide.

A profile lets all other parameters follow: a walk along the floor from the fit to either end of the coefficient's
range, with a Gauss-Newton step in all else at every place (see `fitting.valley`).
"""

from dataclasses import dataclass

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.objective import Swims
from fitting.search_space import ROOTS, SearchSpace, parameters
from fitting.valley import walk

POINTS = 7


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
    sliced = swims.mean_distance(parameters(held)).reshape(5, POINTS)
    followed = np.array([_followed(space, best, i, roots) for i in range(5)])
    return CoefficientProfiles(np.tile(roots**2, (5, 1)), sliced, np.minimum(sliced, followed), fit.mean_distance_m)


def _followed(space: SearchSpace, best: np.ndarray, index: int, roots: np.ndarray) -> list[float]:
    """(k,) mean distance at each root of one coefficient, all else following from the best (p,), m."""
    below, above = roots[roots < best[index]][::-1], roots[roots >= best[index]]
    steps = walk(space, best, index, below)[::-1] + walk(space, best, index, above)
    return [step.distance_m for step in steps]
