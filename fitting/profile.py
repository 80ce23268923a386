"""How the objective rises along each coefficient: which the data hold, and which can slide.

A profile lets all other parameters follow: a walk along the floor from the fit to either end of the coefficient's
range, with a Gauss-Newton step in all else at every place (see `fitting.valley`), from the place before or, where that
is lower, from the nearest restart of the search. One step a place is not a search: what is found bounds the true
profile from above. So does every restart at its own coefficients; none of them lies below `CoefficientProfiles.curve`.
"""

from dataclasses import dataclass

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.objective import Swims
from fitting.search_space import ROOTS, SearchSpace, parameters
from fitting.valley import walk

POINTS = 6


@dataclass(frozen=True, eq=False)
class CoefficientProfiles:
    """The mean marker distance along each coefficient.

    Whether a twin swims forward from rest is asked of the fit and the restarts only, not of the other places.

    Attributes:
        value: (5, k) values of the coefficient.
        slice_m: (5, k) mean distance with all else held, m.
        profile_m: (5, k) mean distance with all else following, m; never above the slice.
        best_m: at the fit itself, m.
        restart: (r, 5) coefficients where the other restarts that swim forward ended.
        restart_m: (r,) mean distance there, m.
    """

    value: np.ndarray
    slice_m: np.ndarray
    profile_m: np.ndarray
    best_m: float
    restart: np.ndarray
    restart_m: np.ndarray

    def curve(self, index: int, best: float) -> tuple[np.ndarray, np.ndarray]:
        """The profile of one coefficient with all that is known: values (n,), mean distances (n,), m.

        Straight between its values on the square-root scale; restarts below such a line become values of their own.

        Args:
            index: of the coefficient.
            best: its value at the fit.
        """
        root, height = _inserted(np.sqrt(self.value[index]), self.profile_m[index], np.sqrt(best), self.best_m)
        for at, distance in zip(np.sqrt(self.restart[:, index]), self.restart_m, strict=True):
            if distance < np.interp(at, root, height):
                root, height = _inserted(root, height, at, distance)
        return root**2, height


def _inserted(root: np.ndarray, height: np.ndarray, at: float, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """A curve (n,) with one more place; where there is one already, the lower of the two."""
    place = int(np.searchsorted(root, at))
    if place < len(root) and root[place] == at:
        return root, np.where(root == at, np.minimum(height, distance), height)
    return np.insert(root, place, at), np.insert(height, place, distance)


def profile_objective(swims: Swims, fit: CoefficientFit) -> CoefficientProfiles:
    """Profiles around a fit, over the whole range of each coefficient; denser near zero."""
    space, roots = SearchSpace(swims), np.linspace(ROOTS[0], ROOTS[1], POINTS)
    others = fit.restarts if fit.in_the_middle else fit.restarts[1:]  # the first restart is the fit itself
    ends = [restart.point for restart in others if restart.swims_forward]
    known = [np.append(np.sqrt(fit.coefficients), fit.phase_rad), *ends]  # (p,) each
    held = np.tile(known[0][:, None], 5 * POINTS)
    for i in range(5):
        held[i, i * POINTS : (i + 1) * POINTS] = roots
    distances = swims.mean_distance(parameters(np.column_stack([held, *known])))
    sliced, at_known = distances[: 5 * POINTS].reshape(5, POINTS), distances[5 * POINTS :]
    followed = np.array([_followed(space, known, i, roots, at_known[0]) for i in range(5)])
    return CoefficientProfiles(
        value=np.tile(roots**2, (5, 1)),
        slice_m=sliced,
        profile_m=np.minimum(sliced, followed),
        best_m=float(at_known[0]),
        restart=parameters(np.reshape(ends, (-1, space.size)).T)[:5].T,
        restart_m=at_known[1:],
    )


def _followed(space: SearchSpace, known: list[np.ndarray], index: int, roots: np.ndarray, best_m: float) -> list[float]:
    """(k,) mean distance at each root of one coefficient, all else following from the first of known points, m."""
    best = known[0]

    def followed(to: np.ndarray) -> list[float]:
        return [step.distance_m for step in walk(space, best, index, to, known)]

    here = [best_m] * int((roots == best[index]).sum())  # a fit at a bound
    return followed(roots[roots < best[index]][::-1])[::-1] + here + followed(roots[roots > best[index]])
