"""All searches side by side: each once a seed and objective, and what found nothing is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.searches import SearchRun, compare_methods, search_scores
from fitting.coefficients import QUICK
from fitting.methods import METHODS
from session.errors import SimulationDiverged
from swimmer import FluidCoefficients
from tests.fitting.exact_swims import exact_swims, exact_twin

TINY = replace(QUICK, screened=2, starts=1, finalists=1, heat_iterations=1, final_iterations=1)
RUN = SearchRun(
    method="bo-nm",
    comparison="published",
    seed=3,
    coefficients=FluidCoefficients(0.1, 1 / 3, 2.0, 4.5, 0.0),
    best_m=0.0123,
    evaluations=40,
    simulated_s=311.5,
    seconds=1.75,
    trace=((20.0, 0.03), (300.0, 0.0123)),
)
NOTHING = replace(RUN, method="gradient", coefficients=None, best_m=float("nan"), seconds=float("nan"), trace=())


@pytest.mark.long
def test_every_search_runs_on_both_objectives_with_every_seed() -> None:
    told: list[float | None] = []
    fitted = exact_swims(hz=(1.2,), seconds=2.0)
    runs = compare_methods(fitted, exact_twin(), 1, 40.0, TINY, tell=lambda _message, share: told.append(share))

    assert [(run.comparison, run.method) for run in runs] == [(c, m) for c in ("published", "shape") for m in METHODS]
    assert told == pytest.approx(np.arange(4) / 4)
    for run in runs:
        assert run.coefficients is None or run.trace[-1][1] == run.best_m


def test_a_search_that_finds_nothing_is_kept_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: object) -> None:
        raise SimulationDiverged("none swims forward")

    monkeypatch.setattr("benchmarks.searches.search", nothing)
    runs = compare_methods((), exact_twin(), 2, 40.0)

    assert len(runs) == 2 * 2 * len(METHODS)
    assert {run.coefficients for run in runs} == {None}
    assert all(np.isnan(run.best_m) for run in runs)


def test_the_table_has_a_row_a_search_and_objective() -> None:
    published, shape = search_scores(
        [RUN, replace(RUN, seed=4, best_m=0.0323), NOTHING], "calib benchmark search S"
    ).tables
    found = {row[0]: row[1:] for row in published.rows}
    assert [*found] == [*METHODS.values()]
    assert found[METHODS["bo-nm"]][:3] == ("12.30", "22.30", "32.30")
    others = [row for row in (*published.rows, *shape.rows) if row[0] != METHODS["bo-nm"]]
    assert {row[1] for row in others} == {"nothing that swims forward"}
