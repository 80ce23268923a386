"""All searches side by side: each once a seed and objective, and what found nothing is told."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.searches import compare_methods
from fitting.methods import METHODS
from fitting.objective import Swims
from session.errors import SimulationDiverged
from tests.fitting.exact_swims import exact_twin


def test_the_table_has_a_row_a_search_and_objective(monkeypatch: pytest.MonkeyPatch) -> None:
    def found(method: str, swims: Swims, _effort: object, seed: int, budget_s: float) -> SimpleNamespace:
        if method == "bo-nm" or (swims.comparison == "shape" and seed):
            raise SimulationDiverged("none swims forward")
        return SimpleNamespace(mean_distance_m=0.0123 + 0.02 * seed, evaluations=40, spent_s=budget_s, seconds=1.75)

    monkeypatch.setattr("benchmarks.searches.search", found)
    told: list[float | None] = []
    scores = compare_methods((), exact_twin(), 2, 311.5, tell=lambda _message, share: told.append(share))
    published, shape = ({row[0]: row[1:] for row in table.rows} for table in scores.tables)
    assert told == pytest.approx(np.arange(8) / 8)
    assert [*published] == [*shape] == [*METHODS.values()]
    assert published[METHODS["gradient"]] == ("12.30", "22.30", "32.30", "40", "312", "2")
    assert shape[METHODS["gradient"]][:3] == ("12.30",) * 3
    assert published[METHODS["bo-nm"]][0] == "nothing that swims forward"
