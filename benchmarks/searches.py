"""All searches on the same trials with the same budget of simulated seconds, over several seeds."""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from benchmarks.cases import Tell
from benchmarks.scores import Scores, Table
from fitting.coefficient_fit import CoefficientFit
from fitting.coefficients import FULL, Effort
from fitting.methods import METHODS, search
from fitting.objective import Comparison, Swims
from fitting.trial import MeasuredTrial
from session.errors import SimulationDiverged
from swimmer import Twin

MILLIMETRES = 1000.0
COMPARISONS: tuple[Comparison, ...] = ("published", "shape")
_COLUMNS = ("search", "best, mm", "mean", "worst", "points", "simulated s", "wall s")


def compare_methods(
    fitted: Sequence[MeasuredTrial],
    twin: Twin,
    seeds: int,
    budget_s: float = FULL.budget_s,
    effort: Effort = FULL,
    tell: Tell = lambda _message, _share: None,
) -> Scores:
    """Runs every search on both objectives: a row a search, best, mean and worst over seeds, and what it cost.

    Args:
        fitted: the fit trials.
        twin: with their markers.
        seeds: how many seeds each.
        budget_s: simulated seconds for the searches that take a budget; the gradient search needs about that of FULL.
        effort: of the gradient search.
        tell: called with what is going on and the share done.
    """
    tables, done, runs = [], 0, seeds * len(METHODS) * len(COMPARISONS)
    for comparison in COMPARISONS:
        rows = []
        for name, label in METHODS.items():
            fits = []
            for seed in range(seeds):
                tell(f"{name}, {comparison} objective, seed {seed}", done / runs)
                done += 1
                with suppress(SimulationDiverged):  # nothing that swims forward was found
                    fits.append(search(name, Swims(twin, tuple(fitted), comparison), effort, seed, budget_s))
            rows.append((label, *_over_seeds(fits)))
        tables.append(Table(f"The {comparison} objective, {seeds} seeds", _COLUMNS, tuple(rows)))
    command = f"calib benchmark search SESSION --seeds {seeds} --budget {budget_s:g}"
    data = "the fit trials of a session; simulated points, the same budget each"
    return Scores("Searches for the coefficients", data, command, tuple(tables))


def _over_seeds(fits: Sequence[CoefficientFit]) -> tuple[str, ...]:
    """Of those that found something: best, mean and worst; points, simulated seconds and wall time in the mean."""
    if not fits:
        return "nothing that swims forward", *[""] * 5
    mm = MILLIMETRES * np.array([fit.mean_distance_m for fit in fits])
    costs = [np.mean([getattr(fit, key) for fit in fits]) for key in ("evaluations", "spent_s", "seconds")]
    return *(f"{each:.2f}" for each in (mm.min(), mm.mean(), mm.max())), *(f"{each:.0f}" for each in costs)
