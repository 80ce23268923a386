"""All searches on the same trials with the same budget of simulated seconds, over several seeds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.cases import Tell
from benchmarks.scores import Scores, Table
from fitting.coefficients import FULL, Effort
from fitting.methods import METHODS, search
from fitting.objective import Comparison, Swims
from fitting.trial import MeasuredTrial
from session.errors import SimulationDiverged
from swimmer import FluidCoefficients, Twin

MILLIMETRES = 1000.0
COMPARISONS: tuple[Comparison, ...] = ("published", "shape")


@dataclass(frozen=True)
class SearchRun:
    """One search with one seed.

    Attributes:
        method: a key of `METHODS`.
        comparison: what it minimised, see `Swims`.
        seed: of every random draw.
        coefficients: the best; None where nothing that swims forward was found.
        best_m: its mean distance, m; nan likewise.
        evaluations, simulated_s, seconds: points, simulated seconds and wall time it took.
        trace: (simulated seconds, best mean distance so far in m) at every new best.
    """

    method: str
    comparison: Comparison
    seed: int
    coefficients: FluidCoefficients | None
    best_m: float
    evaluations: int
    simulated_s: float
    seconds: float
    trace: tuple[tuple[float, float], ...]


def compare_methods(
    fitted: Sequence[MeasuredTrial],
    twin: Twin,
    seeds: int,
    budget_s: float = FULL.budget_s,
    effort: Effort = FULL,
    tell: Tell = lambda _message, _share: None,
) -> tuple[SearchRun, ...]:
    """Runs every search on both objectives.

    Args:
        fitted: the fit trials.
        twin: with their markers.
        seeds: how many seeds each.
        budget_s: simulated seconds for the searches that take a budget; the gradient search needs about that of FULL.
        effort: of the gradient search.
        tell: called with what is going on and the share done.
    """
    plan = [(c, method, seed) for c in COMPARISONS for method in METHODS for seed in range(seeds)]
    runs = []
    for i, (comparison, method, seed) in enumerate(plan):
        tell(f"{method}, {comparison} objective, seed {seed}", i / len(plan))
        swims = Swims(twin, tuple(fitted), comparison)
        try:
            fit = search(method, swims, effort, seed, budget_s)
        except SimulationDiverged:
            runs.append(SearchRun(method, comparison, seed, None, float("nan"), 0, budget_s, float("nan"), ()))
            continue
        runs.append(
            SearchRun(
                method=method,
                comparison=comparison,
                seed=seed,
                coefficients=fit.coefficients,
                best_m=fit.mean_distance_m,
                evaluations=fit.evaluations,
                simulated_s=fit.spent_s,
                seconds=fit.seconds,
                trace=fit.trace,
            )
        )
    return tuple(runs)


def search_scores(runs: Sequence[SearchRun], command: str) -> Scores:
    """A row a search: best, mean and worst over seeds, and what it cost.

    Args:
        runs: of all searches.
        command: that made them.
    """
    tables = []
    for comparison in COMPARISONS:
        rows = []
        for name, label in METHODS.items():
            chosen = [run for run in runs if run.method == name and run.comparison == comparison]
            best = MILLIMETRES * np.array([run.best_m for run in chosen])
            if not len(best) or np.isnan(best).all():
                rows.append((label, "nothing that swims forward", *[""] * 5))
                continue
            distances = (np.nanmin(best), np.nanmean(best), np.nanmax(best))
            cost = [np.mean([getattr(run, key) for run in chosen]) for key in ("evaluations", "simulated_s", "seconds")]
            rows.append((label, *(f"{mm:.2f}" for mm in distances), *(f"{each:.0f}" for each in cost)))
        columns = ("search", "best, mm", "mean", "worst", "points", "simulated s", "wall s")
        tables.append(
            Table(f"The {comparison} objective, {len({run.seed for run in runs})} seeds", columns, tuple(rows))
        )
    data = "the fit trials of a session; simulated points, the same budget each"
    return Scores("Searches for the coefficients", data, command, tuple(tables))
