"""The published search: Bayesian optimisation of the coefficients, then Nelder-Mead over coefficients and phases.

"Simple Models, Real Swimming" (2026) finds its five coefficients so, on the mean marker distance after warm-up. The
proposals of the Bayesian optimisation come in batches (constant liar) so that all cores are used; its Gaussian
process runs on one BLAS thread, which is several times faster at this size.
"""

import nlopt
import numpy as np
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from fitting.objective import COEFFICIENT_BOUNDS
from fitting.published_objective import PublishedObjective

INITIAL, BATCH = 16, 4  # Sobol points before the first proposal; proposals a batch
BAYESIAN_SHARE = 0.3  # of the budget, the rest is Nelder-Mead's
SIMPLEX = (1.0, 0.1)  # first steps of the simplex, in coefficients and in phases (rad)


def bayesian(objective: PublishedObjective, budget_s: float, seed: int) -> None:
    """Spends a budget of simulated seconds on Bayesian optimisation over the five coefficients."""
    from bayes_opt import BayesianOptimization, acquisition  # half a second that no other search needs

    low, high = COEFFICIENT_BOUNDS
    names = [f"c{i}" for i in range(5)]
    liar = acquisition.ConstantLiar(acquisition.ExpectedImprovement(xi=5e-4))
    search = BayesianOptimization(
        None, dict.fromkeys(names, (low, high)), acquisition_function=liar, random_state=seed, verbose=0
    )

    def evaluate(coefficients: np.ndarray) -> None:
        distances = objective(objective.phased(coefficients))
        for values, distance in zip(coefficients, distances, strict=True):
            search.register(dict(zip(names, values, strict=True)), -float(distance))

    with threadpool_limits(1):
        evaluate(low + (high - low) * qmc.Sobol(5, rng=np.random.default_rng(seed)).random(INITIAL))
        while objective.spent_s < budget_s:
            proposals = [search.suggest() for _ in range(BATCH)]
            evaluate(np.array([[float(p[name]) for name in names] for p in proposals]))


def nelder_mead(objective: PublishedObjective, budget_s: float, start: np.ndarray) -> bool:
    """Spends the rest of a budget on bounded Nelder-Mead (nlopt) from a point (p,) of coefficients and phases.

    Whether it converged: its simplex became small before the budget was spent.

    Args:
        objective: counts what is spent and keeps the best.
        budget_s: simulated seconds at which it ends, unless it has converged before.
        start: the first point.
    """
    optimiser = nlopt.opt(nlopt.LN_NELDERMEAD, len(start))
    low, high = objective.bounds
    optimiser.set_lower_bounds(low)
    optimiser.set_upper_bounds(high)
    steps = np.append(np.full(5, SIMPLEX[0]), np.full(len(start) - 5, SIMPLEX[1]))
    steps[start + steps > high] *= -1
    optimiser.set_initial_step(steps)
    optimiser.set_xtol_rel(1e-5)
    return objective.minimised(optimiser, np.clip(start, low, high), np.array, budget_s)


def bayesian_then_nelder_mead(objective: PublishedObjective, budget_s: float, seed: int) -> bool:
    """The published order of the two; whether the second converged."""
    bayesian(objective, BAYESIAN_SHARE * budget_s, seed)
    return nelder_mead(objective, budget_s, objective.best_point)
