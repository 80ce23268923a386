"""The nearest twin is found where the answer is known, and the search ends once it stands still."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from benchmarks.effects.rows import nearest
from fitting.session_model import SessionModel

TRUTH, SD = np.array([1.0, 3.0, 5.0, 4.0, 2.0]), 0.01


@dataclass(frozen=True, eq=False)
class LinearModel:
    """One trial whose features are linear in the coefficients but for a bend; it counts how often it was asked."""

    bend: float = 0.0

    slopes: np.ndarray = field(default_factory=lambda: np.random.default_rng(0).standard_normal((40, 5)))
    asked: list[int] = field(default_factory=list)

    @property
    def measured(self) -> np.ndarray:
        return self._features(TRUTH[None])[0]

    @property
    def trials(self) -> list[SimpleNamespace]:
        return [
            SimpleNamespace(trial=SimpleNamespace(commanded_hz=1.0, filmed_hz=1.0, frequency=SimpleNamespace(hz=1.0)))
        ]

    logged, frequencies, beside, rings, measured_creeps = (), 1, 1, (), np.zeros(0)

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        self.asked.append(len(coefficients))
        return self._features(coefficients)

    def _features(self, coefficients: np.ndarray) -> np.ndarray:
        return (coefficients + self.bend * coefficients**2) @ self.slopes.T


def found(model: LinearModel, start: np.ndarray) -> np.ndarray:
    return nearest(cast(SessionModel, model), start, SD**2 * np.eye(41))


def rounds(model: LinearModel) -> int:
    return sum(count > 1 for count in model.asked)


@pytest.mark.parametrize("off", [0.5, -0.5, 2.0])
def test_the_nearest_twin_is_found_and_the_search_ends_there(off: float) -> None:
    model = LinearModel()
    assert found(model, TRUTH + off) == pytest.approx(TRUTH, abs=2e-4)
    assert 1 < rounds(model) <= 7
    assert (found(model, np.array([0.0, 10.0, 0.0, 10.0, 0.0])) >= 0).all()
    near = LinearModel()
    assert found(near, TRUTH + 1e-5) == pytest.approx(TRUTH, abs=1e-5)
    assert rounds(near) == 1


def test_slopes_are_mended_and_simulated_only_after_long_steps() -> None:
    model = LinearModel(bend=0.03)
    assert found(model, TRUTH + 0.3) == pytest.approx(TRUTH, abs=2e-3)
    assert rounds(model) <= 4
    assert len(model.asked) > rounds(model) + 2
