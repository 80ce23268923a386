"""The published search spends what it is given, and keeps the best that swims forward."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fitting.published import _PENALTY, PublishedFit, Swims, _Search, published_search
from swimcal.errors import SimulationDiverged
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin

BUDGET_S, CUT_S, LONG_S = 300.0, 50.0, 5000.0
TRUTH = np.append(PLAUSIBLE_COEFFICIENTS, PHASES[:2])[:, None]
FORWARD = "fitting.published.swims_forward"


@dataclass(frozen=True, eq=False)
class EasySwims(Swims):
    """Distances that grow with the squared distance of the parameters from the truth."""

    def mean_distance(self, parameters: np.ndarray) -> np.ndarray:
        return np.asarray(2e-3 + 1e-4 * ((parameters - TRUTH) ** 2).sum(axis=0))


@pytest.fixture
def easy(monkeypatch: pytest.MonkeyPatch) -> EasySwims:
    """Nothing is simulated: all swim forward, and all phases begin at zero."""
    search = "fitting.published"
    monkeypatch.setattr(FORWARD, lambda _twin, c, _trials: np.ones(len(c), bool))
    monkeypatch.setattr(f"{search}.probed_hz", lambda _trials: np.inf)
    monkeypatch.setattr(f"{search}.phase_from_harmonic", lambda _twin, _trial, c, _hz: np.zeros(len(c)))
    monkeypatch.setattr(f"{search}._BAYESIAN_SHARE", 0.01)
    return EasySwims(exact_twin(), exact_swims(hz=(0.7, 1.2), seconds=1.2))


@pytest.fixture(scope="module")
def swims() -> Swims:
    return Swims(exact_twin(), exact_swims(hz=(0.7, 1.2), seconds=3.5))


@pytest.fixture(scope="module")
def reported() -> list[tuple[float, float]]:
    return []


@pytest.fixture(scope="module")
def fit(swims: Swims, reported: list[tuple[float, float]]) -> PublishedFit:
    return published_search(swims, BUDGET_S, progress=lambda share, best_m: reported.append((share, best_m)))


def test_the_best_is_as_far_off_as_it_says_and_within_bounds(swims: Swims, fit: PublishedFit) -> None:
    point = np.append(fit.coefficients, fit.phase_rad)[:, None]

    assert swims.mean_distance(point)[0] == pytest.approx(fit.mean_distance_m, rel=1e-9)
    np.testing.assert_array_equal(fit.coefficients, np.clip(fit.coefficients, 0, 10))


def test_progress_is_the_share_spent_and_the_best(fit: PublishedFit, reported: list[tuple[float, float]]) -> None:
    shares, best = np.array(reported).T

    assert (np.diff(shares) >= 0).all()
    assert shares[-1] == 1.0
    assert (np.diff(best) <= 0).all()
    assert best[-1] == fit.mean_distance_m


@pytest.mark.long
def test_the_order_of_trials_does_not_change_a_bit(swims: Swims, fit: PublishedFit) -> None:
    other = published_search(Swims(swims.twin, swims.trials[::-1]), BUDGET_S)

    assert other.coefficients == fit.coefficients
    np.testing.assert_array_equal(other.phase_rad, fit.phase_rad[::-1])


@pytest.mark.long
def test_a_long_budget_converges_and_a_cut_one_does_not(easy: EasySwims) -> None:
    cut, whole = (published_search(easy, budget_s) for budget_s in (CUT_S, LONG_S))

    assert not cut.converged
    assert whole.converged
    assert whole.mean_distance_m < cut.mean_distance_m


def test_the_simplex_finds_the_truth_from_a_wrong_start(easy: EasySwims) -> None:
    search = _Search(easy, LONG_S, lambda _share, _best: None)
    search.best = 1.3 * TRUTH[:, 0]

    assert search.nelder_mead()
    assert search.best == pytest.approx(TRUTH[:, 0], rel=1e-2)


def test_a_budget_too_small_for_one_forward_swimmer_says_so(swims: Swims, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FORWARD, lambda *_: np.zeros(1, bool))

    with pytest.raises(SimulationDiverged, match=r"none of \d+ points within 40 simulated seconds swims forward"):
        published_search(swims, 40.0)


def test_what_would_win_but_swims_backward_has_a_penalty(easy: EasySwims, monkeypatch: pytest.MonkeyPatch) -> None:
    search = _Search(easy, BUDGET_S, lambda _share, _best: None)
    points = np.repeat(TRUTH, 3, axis=1)
    points[0] += [1.0, 0.5, 2.0]
    plain = easy.mean_distance(points)
    monkeypatch.setattr(FORWARD, lambda _twin, c, _trials: [c[0, 0] != points[0, 1]])

    assert search(points) == pytest.approx(plain * [1.0, _PENALTY, 1.0])
    assert search.best_m == pytest.approx(plain[0])
    np.testing.assert_array_equal(search.best, points[:, 0])
