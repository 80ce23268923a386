"""The last tenths of a millimetre: Nelder-Mead (nlopt) with a simplex that has the shape of the valley.

The floor is rough, which stops Gauss-Newton, and long and thin, which stops a simplex with edges along the
coefficients: it creeps. Here the edges lie along the axes of the objective's curvature, each as long as the same rise
takes, so that the simplex sees a round bowl. Where it ends, the next one starts with the curvature there.
"""

import nlopt
import numpy as np

from fitting.published_objective import PublishedObjective
from fitting.search_space import SearchSpace, parameters

RISE_M = 2e-4  # of the objective along an edge, four times its roughness
LONGEST = 0.5  # edge, in roots
SMALL = 0.02  # of the edges: a simplex that has shrunk to it ends
ROUGHNESS_M = 5e-5  # of the objective's floor: gains below it are luck


def descend_in_valley(objective: PublishedObjective, budget_s: float) -> bool:
    """Spends the rest of a budget of simulated seconds on simplices, each around the best so far.

    Whether it converged: a simplex became small without a gain above the roughness, nor did any after it gain more.
    """
    converged = False
    while objective.spent_s < budget_s:
        before_m, best = objective.best_m, objective.best_point
        point = np.append(np.sqrt(best[:5]), best[5:])
        small = _descend(objective, budget_s, point, _edges(objective.space, point))
        converged = (small or converged) and before_m - objective.best_m <= ROUGHNESS_M
    return converged


def _edges(space: SearchSpace, point: np.ndarray) -> np.ndarray:
    """(p, p) steps from a point (p,) of the search space, one in each column, by which the objective rises alike."""
    errors = space.errors(point[:, None])
    curvature, axes = np.linalg.eigh(space.norm.curvature(errors, space.slopes(point[:, None], errors)))
    return axes * np.minimum(np.sqrt(2 * RISE_M / np.maximum(np.abs(curvature), 1e-12)), LONGEST)


def _descend(objective: PublishedObjective, budget_s: float, point: np.ndarray, edges: np.ndarray) -> bool:
    """One simplex; whether it became small before the budget was spent."""
    space = objective.space
    optimiser = nlopt.opt(nlopt.LN_NELDERMEAD, space.size)
    optimiser.set_initial_step(np.ones(space.size))
    optimiser.set_xtol_abs(SMALL)

    def along(steps: np.ndarray) -> np.ndarray:
        return parameters(np.clip(point + edges @ steps, space.low, space.high))

    return objective.minimised(optimiser, np.zeros(space.size), along, budget_s)
