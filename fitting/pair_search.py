"""A small search for two trials at a time: the same points of the box for every choice, looked at once for each trial.

What a point of the box is worth for a trial does not depend on which other trial it is paired with, so the screening
is shared; what follows is each pair's own.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from fitting.coefficient_fit import Restart
from fitting.coefficients import refine_coefficients
from fitting.objective import Swims
from fitting.search_space import ROOTS, SearchSpace
from fitting.starts import promising
from fitting.trial import MeasuredTrial
from swimmer import PUBLISHED_COEFFICIENTS, Twin

SCREENED = 64  # points of the box
CHECKED, STARTS = 32, 2  # of these the best; of these again the best that lie apart and swim forward
APART = 1.0  # in roots
HEAT, POLISH = 3, 10  # iterations of Gauss-Newton at most


class Screened(NamedTuple):
    """The same points of the box, looked at for one trial.

    Attributes:
        points: (6, s) roots of coefficients and the phase that is in step with the trial, rad.
        objective_m: (s,) softened mean distance, m.
    """

    points: np.ndarray
    objective_m: np.ndarray


def screen(twin: Twin, trial: MeasuredTrial, seed: int) -> Screened:
    """Points of the box, the same for every trial, each in step with this one."""
    roots = ROOTS[0] + np.ptp(ROOTS) * qmc.Sobol(5, rng=np.random.default_rng(seed)).random(SCREENED)
    space = SearchSpace(Swims(twin, (trial,)))
    points = space.in_step(np.vstack([PUBLISHED_COEFFICIENTS, roots**2]))
    return Screened(points, space.objectives(points))


def search_pair(swims: Swims, screened: Sequence[Screened]) -> Restart:
    """The best twin of some trials, from points screened for each; one that swims forward if any start led to one."""
    starts = _starts(SearchSpace(swims), screened)
    heats = refine_coefficients(swims, starts, HEAT, central=False).restarts
    polished = refine_coefficients(swims, [heats[0].point], POLISH, central=False).restarts
    return min((*polished, *heats), key=lambda restart: (not restart.swims_forward, restart.objective_m))


def _starts(space: SearchSpace, screened: Sequence[Screened]) -> list[np.ndarray]:
    """(p,) the best points that lie apart, forward swimmers first."""
    objective_m = np.mean([of_trial.objective_m for of_trial in screened], axis=0)
    points = np.vstack([screened[0].points[:5], *(of_trial.points[5] for of_trial in screened)])
    return promising(space, points[:, np.argsort(objective_m)[:CHECKED]], STARTS, APART)
