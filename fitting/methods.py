"""The searches one can choose from: each finds the five coefficients and a phase a trial for the same objective."""

import time
from dataclasses import replace
from typing import Literal

import numpy as np

from fitting.coefficient_fit import CoefficientFit, Restart, flags_of
from fitting.coefficients import Effort, Progress, fit_coefficients
from fitting.objective import Swims
from fitting.precision import intervals
from fitting.published_objective import PublishedObjective
from fitting.published_search import bayesian_then_nelder_mead
from fitting.search_space import SearchSpace
from fitting.smooth_floor import settled
from fitting.valley_simplex import ROUGHNESS_M, descend_in_valley
from session.errors import SimulationDiverged
from swimmer import FluidCoefficients

MethodName = Literal["gradient", "bo-nm"]
METHODS: dict[str, str] = {
    "gradient": "Gauss-Newton from many starts, then Nelder-Mead",
    "bo-nm": "Bayesian optimisation, then Nelder-Mead (published)",
}
"""The searches by their names on the command line, with what they do.

The gradient search stops by itself and leaves its last millimetre to a simplex, because the objective's floor is rough;
the published one spends a budget of simulated seconds.
"""


def search(
    method: str,
    swims: Swims,
    effort: Effort,
    seed: int = 0,
    budget_s: float | None = None,
    progress: Progress | None = None,
) -> CoefficientFit:
    """Runs one search, a thorough one to the middle of the floor; in which order the trials come does not matter.

    Args:
        method: a key of `METHODS`.
        swims: the fit trials, the twin, and how they are compared.
        effort: how hard the gradient search works; for the published one, the budget in simulated seconds.
        seed: of every random draw.
        budget_s: simulated seconds for the published one, instead of the effort's.
        progress: called with the share done, 0 to 1, and the best mean distance so far, m.

    Raises:
        SimulationDiverged: no point that swims forward was found within the budget.
    """
    order = swims.by_name
    ordered = swims.with_trials(order)
    found = _searched(method, ordered, effort, seed, budget_s, progress)
    if effort.valley_steps and swims.comparison == "published":
        found = settled(ordered, found, seed)
    return found.with_trials(np.argsort(order))


def _searched(
    method: str, swims: Swims, effort: Effort, seed: int, budget_s: float | None, progress: Progress | None
) -> CoefficientFit:
    if method == "gradient":
        return _finished(swims, fit_coefficients(swims, effort, seed, progress), effort.finish_s)
    began, budget = time.perf_counter(), effort.budget_s if budget_s is None else budget_s
    objective = PublishedObjective(swims, budget, progress)
    converged = bayesian_then_nelder_mead(objective, budget, seed)
    if not np.isfinite(objective.best_m):
        raise SimulationDiverged(
            f"{METHODS[method]}: none of {objective.space.evaluations} points within {budget:g} simulated "
            "seconds swims forward from rest; give a larger budget or use the gradient search"
        )
    best = _restart(objective, objective.best_point[:5], converged)
    interval = intervals(SearchSpace(swims), best.point)
    return CoefficientFit(
        coefficients=FluidCoefficients(*map(float, best.coefficients)),
        phase_rad=best.phase_rad,
        mean_distance_m=objective.best_m,
        restarts=(best,),
        evaluations=objective.space.evaluations,
        seconds=time.perf_counter() - began,
        flags=flags_of([best], interval),
        method=method,
        spent_s=objective.spent_s,
        trace=tuple(objective.trace),
        interval=interval,
    )


def _finished(swims: Swims, fit: CoefficientFit, budget_s: float) -> CoefficientFit:
    """A fit after simplices around its best point (see `fitting.valley_simplex`); where none helps, the same point."""
    best, began = fit.restarts[0], time.perf_counter()
    if budget_s <= 0 or not best.swims_forward:
        return fit
    objective = PublishedObjective(swims, budget_s)
    objective.best_m, objective.best_point = fit.mean_distance_m, np.append(best.coefficients, best.phase_rad)
    small = descend_in_valley(objective, budget_s)
    converged = small or (best.converged and fit.mean_distance_m - objective.best_m <= ROUGHNESS_M)
    if objective.trace:
        restarts = [_restart(objective, best.start, converged), *fit.restarts]
    else:
        restarts = [replace(best, converged=converged), *fit.restarts[1:]]
    return replace(
        fit,
        coefficients=FluidCoefficients(*map(float, restarts[0].coefficients)),
        phase_rad=restarts[0].phase_rad,
        mean_distance_m=objective.best_m,
        restarts=tuple(restarts),
        evaluations=fit.evaluations + objective.space.evaluations,
        seconds=fit.seconds + time.perf_counter() - began,
        flags=flags_of(restarts, fit.interval),
        spent_s=fit.spent_s + objective.spent_s,
        trace=(*fit.trace, *((fit.spent_s + spent, value) for spent, value in objective.trace)),
    )


def _restart(objective: PublishedObjective, start: np.ndarray, converged: bool) -> Restart:
    """The best of a search as a restart, with the softened objective that the gradient search ranks by."""
    history_m = objective.softened_m
    return Restart(
        start=start,
        coefficients=objective.best_point[:5],
        phase_rad=objective.best_point[5:],
        objective_m=float(history_m[-1]),
        history_m=history_m,
        converged=converged,
    )
