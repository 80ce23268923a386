"""What stands beside a fit: boxes put right, profiles and other pairs, and their way to a file and back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from fitting import CoefficientFit, MeasuredTrial
from fitting.coefficients import refine_coefficients
from fitting.evidence import Evidence, gather_evidence
from fitting.objective import Swims
from fitting.pairs import MODELS, MOST_PAIRS, Screened, chosen_pairs, fit_pairs, screen, search_pair
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin

HZ = (0.7, 1.2, 1.0)
START = np.append(np.sqrt(PLAUSIBLE_COEFFICIENTS), PHASES[:2])


@pytest.fixture(scope="module", autouse=True)
def small() -> Iterator[None]:
    """Searches of pairs and profiles of a few points: what is tested here needs no more."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {"SCREENED": 8, "CHECKED": 2, "STARTS": 1, "HEAT": 1, "POLISH": 1}.items():
            patch.setattr(f"fitting.pairs.{name}", value)
        patch.setattr("fitting.profile.POINTS", 4)
        yield


@pytest.fixture(scope="module")
def trials() -> tuple[MeasuredTrial, ...]:
    slow, fast, new = exact_swims(hz=HZ, seconds=5.0, noise_m=0.5e-3)
    return slow, fast, new.with_role("holdout")


@pytest.fixture(scope="module")
def fit(trials: tuple[MeasuredTrial, ...]) -> CoefficientFit:
    return refine_coefficients(Swims(exact_twin(), trials[:2]), [START], iterations=3)


@pytest.fixture(scope="module")
def evidence(trials: tuple[MeasuredTrial, ...], fit: CoefficientFit) -> Evidence:
    return gather_evidence(trials, exact_twin(), fit)


@pytest.mark.long
def test_profiles_lie_below_slices_and_are_lowest_at_the_fit(evidence: Evidence, fit: CoefficientFit) -> None:
    """To within what the roughness of the objective leaves, far less than the rise to either end."""
    profiles = evidence.profiles
    assert (profiles.profile_m <= profiles.slice_m).all()
    assert profiles.best_m == pytest.approx(fit.mean_distance_m, rel=1e-9)
    assert (profiles.profile_m > 0.98 * profiles.best_m).all()
    for i, coefficient in enumerate(fit.coefficients[:4]):
        nearest = np.argsort(np.abs(np.sqrt(profiles.value[i]) - np.sqrt(coefficient)))[:2]
        assert np.argmin(profiles.slice_m[i]) in nearest
        assert profiles.slice_m[i].max() > 1.5 * profiles.best_m


@pytest.mark.long
def test_boxes_that_sit_right_stay_where_they_are(evidence: Evidence) -> None:
    """Also of the held-out trial, which finds its own from its first beats."""
    assert [trial.name for trial in evidence.placed.trials] == ["f0.70", "f1.20", "f1.00"]
    assert np.abs([trial.boxes for trial in evidence.placed.trials]).max() < 0.002
    assert np.abs(evidence.placed.marker_m).max() < 0.002
    assert evidence.placed.mean_distance_m <= 1.05 * evidence.profiles.best_m
    assert not evidence.placed.flags


@pytest.mark.long
def test_every_pair_is_fitted_once_whatever_the_order(trials: tuple[MeasuredTrial, ...], evidence: Evidence) -> None:
    """Bit for bit in any order: their screening, their choice and their means go by the trials' names."""
    assert [pair.fitted for pair in evidence.pairs] == [("f0.70", "f1.00"), ("f0.70", "f1.20"), ("f1.00", "f1.20")]
    for pair in evidence.pairs:
        assert tuple(pair.speed_mae) == MODELS
        assert all(np.isfinite(list(pair.speed_mae.values())))
    assert fit_pairs(trials[::-1], exact_twin()) == evidence.pairs


@pytest.mark.long
def test_a_held_out_trial_is_never_looked_at_beyond_its_known_part(
    trials: tuple[MeasuredTrial, ...], evidence: Evidence
) -> None:
    """Nonsense in the scored part of the third trial changes no coefficient of the pair that leaves it out."""
    new = trials[2]
    later = ~new.known
    spoilt_head = replace(new.head, shape_m=np.where(later[:, None, None], 5.0, new.head.shape_m))
    pairs = {pair.fitted: pair for pair in fit_pairs((*trials[:2], replace(new, head=spoilt_head)), exact_twin())}
    clean, spoilt = evidence.pairs[1], pairs["f0.70", "f1.20"]

    assert clean.fitted == spoilt.fitted
    assert spoilt.coefficients == clean.coefficients
    assert spoilt.marker_error_m == clean.marker_error_m


def test_the_same_points_are_screened_for_each_trial(trials: tuple[MeasuredTrial, ...]) -> None:
    slow, fast = (screen(exact_twin(), trial, seed=3) for trial in trials[:2])

    np.testing.assert_array_equal(slow.points[:5], fast.points[:5])
    together = Swims(exact_twin(), trials[:2])
    both = np.vstack([slow.points[:5] ** 2, slow.points[5], fast.points[5]])
    values = [together.norm.value(column[:, None]) for column in together.errors(both).T]
    np.testing.assert_allclose((slow.objective_m + fast.objective_m) / 2, values, rtol=1e-12)


def test_a_forward_swimmer_is_preferred_to_a_closer_backward_one(
    trials: tuple[MeasuredTrial, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two points are screened, and whatever has more slender drag than a bound is said to swim backward."""
    bound = 4.0
    monkeypatch.setattr("fitting.search_space.swims_forward", lambda _twin, c, _trials: c[:, 1] < bound)
    roots = np.sqrt([[0.4, bound + 1.0, 6.0, 4.0, 1.0], [2.0, bound - 2.0, 6.0, 4.0, 1.0]]).T
    screened = [Screened(np.vstack([roots, np.full(2, phase)]), np.array([0.01, 0.02])) for phase in PHASES[:2]]
    best = search_pair(Swims(exact_twin(), trials[:2]), screened)

    assert best.swims_forward
    assert best.coefficients[1] < bound


def test_of_many_pairs_a_seeded_choice_is_made_by_name(
    trials: tuple[MeasuredTrial, ...],
) -> None:
    assert fit_pairs(trials[:2], exact_twin()) == ()
    names = tuple(f"trial {i}" for i in range(8))
    chosen, again, other = (chosen_pairs(names, seed) for seed in (0, 0, 1))

    assert len(set(chosen)) == MOST_PAIRS
    assert chosen == again == chosen_pairs(names[::-1], 0) != other
