"""What stands beside a fit: a free yaw, profiles and other pairs, and their way to a file and back."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fitting import (
    CoefficientFit,
    Evidence,
    MeasuredTrial,
    Swims,
    evidence_payload,
    gather_evidence,
    read_evidence,
)
from fitting.coefficients import refine_coefficients
from fitting.pairs import MOST_PAIRS, _fit_pair, fit_pairs
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin

HZ = (0.7, 1.2, 1.0)
START = np.append(np.sqrt(PLAUSIBLE_COEFFICIENTS), PHASES[:2])


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


def test_a_profile_is_never_above_its_slice(evidence: Evidence) -> None:
    assert evidence.profiles.value.shape == evidence.profiles.slice_m.shape == evidence.profiles.profile_m.shape
    assert (evidence.profiles.profile_m <= evidence.profiles.slice_m).all()


def test_profiles_are_lowest_at_the_fit(evidence: Evidence, fit: CoefficientFit) -> None:
    """To within what the roughness of the objective leaves, far less than the rise to either end."""
    profiles = evidence.profiles
    assert profiles.best_m == fit.mean_distance_m
    assert (profiles.profile_m > 0.98 * profiles.best_m).all()
    for i, coefficient in enumerate(fit.coefficients[:4]):
        nearest = np.argsort(np.abs(np.sqrt(profiles.value[i]) - np.sqrt(coefficient)))[:2]
        assert np.argmin(profiles.slice_m[i]) in nearest
        assert profiles.slice_m[i].max() > 1.5 * profiles.best_m


def test_the_free_yaw_of_straight_axes_is_small_and_named_by_trial(evidence: Evidence) -> None:
    assert list(evidence.yaw.yaw_rad) == ["f0.70", "f1.20"]
    assert np.abs(np.degrees(list(evidence.yaw.yaw_rad.values()))).max() < 1.0
    assert evidence.yaw.mean_distance_m <= 1.02 * evidence.profiles.best_m


def test_every_pair_is_fitted_once_and_forecasts_what_it_has_not_seen(evidence: Evidence) -> None:
    assert [pair.fitted for pair in evidence.pairs] == [("f0.70", "f1.20"), ("f0.70", "f1.00"), ("f1.20", "f1.00")]
    for pair in evidence.pairs:
        assert pair.swims_forward
        assert set(pair.speed_mae) == {"twin", "published", "smoothed", "large"}
        assert pair.speed_mae["twin"] < 0.005


def test_a_held_out_trial_is_never_looked_at_beyond_its_known_part(
    trials: tuple[MeasuredTrial, ...], fit: CoefficientFit, evidence: Evidence
) -> None:
    """Nonsense in the scored part of the third trial changes no coefficient of the pair that leaves it out."""
    new = trials[2]
    head = new.head
    later = ~new.known
    spoilt_head = replace(head, shape_m=np.where(later[:, None, None], 5.0, head.shape_m))
    spoilt = (*trials[:2], replace(new, head=spoilt_head))
    clean = evidence.pairs[0]
    pair = _fit_pair(spoilt, (0, 1), exact_twin(), fit.coefficients)

    assert pair.fitted == clean.fitted == ("f0.70", "f1.20")
    assert pair.coefficients == clean.coefficients
    assert pair.marker_error_m == clean.marker_error_m


def test_two_swims_have_no_other_pair(trials: tuple[MeasuredTrial, ...], fit: CoefficientFit) -> None:
    assert fit_pairs(trials[:2], exact_twin(), fit) == ()


def test_of_many_pairs_a_seeded_choice_is_fitted(fit: CoefficientFit, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fitting.pairs._fit_pair", lambda _trials, pair, *_: pair)
    many = [object()] * 8
    chosen, again, other = (fit_pairs(many, exact_twin(), fit, seed) for seed in (0, 0, 1))  # type: ignore[arg-type]

    assert len(set(chosen)) == MOST_PAIRS
    assert chosen == again != other


def test_evidence_comes_back_from_its_file_as_it_went(evidence: Evidence) -> None:
    back = read_evidence(json.loads(json.dumps(evidence_payload(evidence), allow_nan=False)))

    for name, values in vars(evidence.profiles).items():
        np.testing.assert_allclose(getattr(back.profiles, name), values, rtol=1e-14)
    assert back.yaw.coefficients == evidence.yaw.coefficients
    assert back.yaw.yaw_rad == evidence.yaw.yaw_rad
    assert back.yaw.mean_distance_m == pytest.approx(evidence.yaw.mean_distance_m, rel=1e-14)
    for one, other in zip(back.pairs, evidence.pairs, strict=True):
        assert replace(one, marker_error_m=0.0) == replace(other, marker_error_m=0.0)
        assert one.marker_error_m == pytest.approx(other.marker_error_m, rel=1e-14)


def test_without_pairs_none_are_read(evidence: Evidence) -> None:
    without = replace(evidence, pairs=())

    assert read_evidence(json.loads(json.dumps(evidence_payload(without)))).pairs == ()
