"""The searches compared: what each finds for the same budget, how reliably, and at what cost."""

from collections.abc import Sequence

import numpy as np

from fitting import METHODS, Comparison, SearchRun
from reports.blocks import Block, Column, Plot, Plots, Prose, Section, Table
from reports.context import ReportContext
from reports.figures.search_convergence import SHORT, search_convergence_figure
from reports.numbers import MISSING, counted, in_mm, listed, shown
from reports.objectives import OBJECTIVES

TITLE, ANCHOR = "Comparison of searches", "searches"
LABELS = {name: method.label for name, method in METHODS.items()}
LEVEL = 1.01  # mean distance within this factor of the lowest: no worse
COLUMNS = (
    Column("search", numeric=False),
    Column("best", "mm"),
    Column("mean", "mm"),
    Column("worst", "mm"),
    Column("seeds"),
    Column("points"),
    Column("simulated", "s"),
    Column("wall time", "s"),
)


def build(context: ReportContext) -> Section:
    """A table and a figure for each objective; without runs, how to make them."""
    runs = context.searches
    if not runs:
        text = (
            "The searches were not compared on this session: that takes from minutes to an hour, far longer than the "
            "fit. Run calib benchmark search SESSION and then calib report SESSION: the first runs each of "
            f"{listed(list(LABELS.values()))} with the same budget and several seeds, the second shows them here."
        )
        return Section(TITLE, ANCHOR, (Prose(text),))
    objectives = list(dict.fromkeys(run.comparison for run in runs))
    chosen = {objective: [run for run in runs if run.comparison == objective] for objective in objectives}
    blocks: list[Block] = [Prose(" ".join(_winner(objective, of) for objective, of in chosen.items()))]
    blocks.append(Plots(tuple(_plot(objective, of) for objective, of in chosen.items())))
    blocks += [_table(objective, of) for objective, of in chosen.items()]
    return Section(TITLE, ANCHOR, tuple(blocks), _caveats(runs))


def _by_method(runs: Sequence[SearchRun]) -> dict[str, list[SearchRun]]:
    return {name: [r for r in runs if r.method == name] for name in dict.fromkeys(r.method for r in runs)}


def _bests(runs: Sequence[SearchRun]) -> np.ndarray:
    """(s,) what the seeds that found something ended at, m."""
    best = np.array([run.best_m for run in runs])
    return best[np.isfinite(best)]


def _winner(objective: str, runs: Sequence[SearchRun]) -> str:
    means = {name: float(_bests(of).mean()) for name, of in _by_method(runs).items() if len(_bests(of))}
    head = f"On the {objective} objective"
    if not means:
        return f"{head} no search found a point that swims forward."
    order = sorted(means, key=lambda name: means[name])
    level = [name for name in order if means[name] <= LEVEL * means[order[0]]]
    who = listed([LABELS.get(name, name) for name in level], most=4)
    first = f"{head} {who} {'ends lowest' if len(level) == 1 else 'end level (within 1 %)'}, at "
    rest = [f"{in_mm(means[name])} mm ({LABELS.get(name, name)})" for name in order[len(level) :]]
    behind = f", before {listed(rest)}" if rest else ""
    lost = "" if len(order) > 1 else "; no other search found a point that swims forward"
    return f"{first}{in_mm(means[order[0]])} mm on average{behind}{lost}."


def _plot(objective: Comparison, runs: Sequence[SearchRun]) -> Plot:
    searches = {name: [(run.trace, run.simulated_s) for run in of] for name, of in _by_method(runs).items()}
    name = f"search-{objective}"
    return Plot(
        search_convergence_figure(searches, SHORT),
        name,
        f"Best so far on the {objective} objective over the simulated time spent, a line a seed; dots are ends. Lower "
        "and further left is better; seeds that end apart are a search that depends on luck.",
    )


def _table(objective: Comparison, runs: Sequence[SearchRun]) -> Table:
    rows = []
    for name, of in _by_method(runs).items():
        best = _bests(of)
        distances = (in_mm(float(f(best)), 2) if len(best) else MISSING for f in (np.min, np.mean, np.max))
        cost = (
            shown(float(np.mean([getattr(run, key) for run in of])), 0)
            for key in ("evaluations", "simulated_s", "seconds")
        )
        rows.append((LABELS.get(name, name), *distances, f"{len(best)} of {len(of)}", *cost))
    what = OBJECTIVES[objective]
    return Table(
        f"{what[:1].upper()}{what[1:]}. Best, mean and worst are over the seeds that found a point that swims forward; "
        "costs are means.",
        COLUMNS,
        tuple(rows),
    )


def _caveats(runs: Sequence[SearchRun]) -> tuple[str, ...]:
    caveats = []
    seeds = len({run.seed for run in runs})
    if seeds < 3:
        caveats.append(f"With {counted(seeds, 'seed')} the order of the searches may be luck.")
    lost = dict.fromkeys(LABELS.get(run.method, run.method) for run in runs if not np.isfinite(run.best_m))
    if lost:
        caveats.append(f"With some seed {listed(list(lost))} found nothing that swims forward.")
    spent = [run.simulated_s for run in runs if run.method != "gradient"]
    gradient = [run.simulated_s for run in runs if run.method == "gradient"]
    if spent and gradient and max(gradient) > 1.2 * max(spent):
        caveats.append(
            f"The budgets are not equal: the gradient search stops by itself and took {shown(max(gradient), 0)} "
            f"simulated seconds, the others were given {shown(max(spent), 0)}."
        )
    return tuple(caveats)
