"""Every search spends what it is given, keeps the best that swims forward, and tells how it came down."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fitting import CoefficientFit
from fitting.coefficients import QUICK
from fitting.mean_distance import SOFTENING_M
from fitting.methods import METHODS, search
from fitting.objective import Swims
from fitting.published_objective import PENALTY, PublishedObjective
from fitting.valley_simplex import ROUGHNESS_M
from session.errors import SimulationDiverged
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin

BUDGET_S, CUT_S, LONG_S = 300.0, 50.0, 5000.0
SLOPE, OFF_M = 3e-3, 2e-3  # of the easy swims
TINY = replace(QUICK, screened=4, starts=1, finalists=1, heat_iterations=1, final_iterations=1, finish_s=120.0)
each_method = pytest.mark.parametrize("method", METHODS)


@dataclass(frozen=True, eq=False)
class EasySwims(Swims):
    """Errors that are linear in coefficients and phases, beside some that no coefficient takes away."""

    def errors(self, parameters: np.ndarray) -> np.ndarray:
        random, samples = np.random.default_rng(0), sum(int((t.weight[t.scored] > 0).sum()) for t in self.trials)
        truth = np.append(PLAUSIBLE_COEFFICIENTS, PHASES[: len(self.trials)])[:, None]
        slopes = SLOPE * random.normal(size=(2 * samples, len(truth)))
        return OFF_M * random.normal(size=(2 * samples, 1)) + slopes @ (parameters - truth)

    def mean_distance(self, parameters: np.ndarray) -> np.ndarray:
        return np.array([float(self.norm.plain(column[:, None])) for column in self.errors(parameters).T])


@pytest.fixture
def easy(monkeypatch: pytest.MonkeyPatch) -> EasySwims:
    """Nothing is simulated: all swim forward, and all phases begin at zero."""
    space = "fitting.search_space"
    monkeypatch.setattr(f"{space}.swims_forward", lambda _twin, c, _trials: np.ones(len(c), bool))
    monkeypatch.setattr(f"{space}.seconds_from_rest", lambda _trials: 0.0)
    monkeypatch.setattr(f"{space}.phase_from_harmonic", lambda _twin, _trial, c, _hz: np.zeros(len(c)))
    return EasySwims(exact_twin(), exact_swims(hz=(0.7, 1.2), seconds=1.2))


@pytest.fixture(scope="module")
def swims() -> Swims:
    return Swims(exact_twin(), exact_swims(hz=(0.7, 1.2), seconds=3.5))


@pytest.fixture(scope="module")
def fits(swims: Swims) -> dict[str, CoefficientFit]:
    return {method: search(method, swims, TINY, seed=0, budget_s=BUDGET_S) for method in METHODS}


@each_method
def test_the_best_swims_forward_and_is_as_far_off_as_it_says(
    method: str, swims: Swims, fits: dict[str, CoefficientFit]
) -> None:
    fit = fits[method]
    point = np.append(fit.coefficients, fit.phase_rad)[:, None]

    assert fit.method == method
    assert fit.restarts[0].swims_forward
    assert swims.mean_distance(point)[0] == pytest.approx(fit.mean_distance_m, rel=1e-9)
    assert np.isclose(fit.coefficients, np.clip(fit.coefficients, 0, 10), rtol=0, atol=0).all()


@each_method
def test_traces_and_histories_come_down_to_the_best(method: str, swims: Swims, fits: dict[str, CoefficientFit]) -> None:
    """Histories are softened, which takes away at most its width of every distance, and always something."""
    spent, best = np.array(fits[method].trace).T

    assert (np.diff(spent) > 0).all()
    assert (np.diff(best) < 0).all()
    assert best[-1] == fits[method].mean_distance_m
    assert spent[-1] <= fits[method].spent_s
    if method == "bo-nm":
        lost = best - fits[method].restarts[0].history_m
        assert ((lost > 0) & (lost < SOFTENING_M)).all()
    for restart in fits[method].restarts:
        point = np.append(restart.coefficients, restart.phase_rad)[:, None]
        assert restart.history_m[-1] == restart.objective_m
        assert restart.objective_m == pytest.approx(float(swims.norm.value(swims.errors(point))), rel=1e-6)


@each_method
def test_a_cut_budget_is_flagged_and_a_long_one_is_not(
    method: str, easy: EasySwims, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The gradient search is stopped after one iteration, so its simplices decide."""
    monkeypatch.setattr("fitting.published_search.BAYESIAN_SHARE", 0.01)
    kinds = []
    for budget_s in (CUT_S, LONG_S):
        fit = search(method, easy, replace(TINY, finish_s=budget_s), budget_s=budget_s)
        kinds.append([flag.kind for flag in fit.flags])
        assert fit.restarts[0].converged == ("not_converged" not in kinds[-1])

    assert "not_converged" in kinds[0]
    assert "not_converged" not in kinds[1]


@pytest.mark.parametrize(("gained", "converged"), [(0.5, True), (10.0, False)])
def test_what_a_cut_simplex_gains_tells_convergence(
    easy: EasySwims, monkeypatch: pytest.MonkeyPatch, gained: float, converged: bool
) -> None:
    """Whatever that thought of its own end; a gain within the roughness of the floor is luck."""

    def gaining(objective: PublishedObjective, _budget_s: float) -> bool:
        better = objective.best_m - gained * ROUGHNESS_M
        objective.consider(objective.best_point[:, None], np.array([better]))
        return False

    monkeypatch.setattr("fitting.methods.descend_in_valley", gaining)
    fit = search("gradient", easy, replace(TINY, final_iterations=150, finish_s=CUT_S))

    assert fit.restarts[1].converged
    assert fit.restarts[0].converged == converged
    assert ("not_converged" in [flag.kind for flag in fit.flags]) != converged


def test_a_budget_too_small_for_one_forward_swimmer_says_so(swims: Swims, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fitting.search_space.swims_forward", lambda *_: np.zeros(1, bool))

    with pytest.raises(SimulationDiverged, match=r"none of \d+ points within 40 simulated seconds swims forward"):
        search("bo-nm", swims, TINY, budget_s=40.0)


def test_what_would_win_but_swims_backward_has_a_penalty(swims: Swims, monkeypatch: pytest.MonkeyPatch) -> None:
    objective = PublishedObjective(swims, BUDGET_S)
    forward = {2.0: False, 3.0: True, 4.0: True}
    monkeypatch.setattr("fitting.search_space.swims_forward", lambda _twin, c, _trials: [forward[c[0, 0]]])
    points = np.tile(np.array([3.0, 2.0, 4.0]), (7, 1))

    considered = objective.consider(points, np.array([0.02, 0.01, 0.03]))

    assert considered == pytest.approx([0.02, 0.01 * PENALTY, 0.03])
    assert objective.best_m == 0.02
    np.testing.assert_array_equal(objective.best_point, points[:, 0])
    spent_s = objective.spent_s
    assert objective.consider(np.ones((7, 1)), np.array([0.025])) == [0.025]  # cannot win: not checked from rest
    assert objective.spent_s == spent_s


def test_progress_is_told_the_share_spent(swims: Swims) -> None:
    told: list[tuple[float, float]] = []
    fit = search("bo-nm", swims, TINY, budget_s=BUDGET_S, progress=lambda share, best: told.append((share, best)))
    shares, best = np.array(told).T

    assert (np.diff(shares) >= 0).all()
    assert shares[-1] == 1.0
    assert best[-1] == fit.mean_distance_m
