"""One camera has one scale: what boxes do to nose and neck of one swim does not make that swim faster."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.picture_scale import with_common_scale
from fitting.trial import MeasuredTrial
from tests.fitting.swims import MARKERS, by_hand, filmed, head_frame_of, straight_swim

LENGTH_M = 0.142
TRUE_M_PER_PX = 0.001
errors = st.lists(st.floats(-0.025, 0.025), min_size=1, max_size=6)


def swim(name: str, error: float, role: str = "fit") -> MeasuredTrial:
    """A swim of 0.1 m/s whose boxes make its own scale wrong by a share."""
    by = np.exp(error)
    position_m = by * straight_swim(20)
    time_s = np.arange(20) / 10.0
    tracks = filmed(MARKERS, time_s, position_m, head_frame_of(position_m), by * TRUE_M_PER_PX)
    start = np.array([-0.1 * by, 0.0, 0.3])
    return by_hand(position_m, name=name, role=role, tracks=tracks, speed=0.1 * by, start_velocity=start)


def swims(of: list[float], role: str = "fit") -> list[MeasuredTrial]:
    return [swim(f"{role}{place}", error, role) for place, error in enumerate(of)]


def kinds(trial: MeasuredTrial) -> list[str]:
    return [flag.kind for flag in trial.flags]


@given(fitted=errors, held_out=errors)
def test_all_swims_have_the_mean_scale_of_the_fitted_ones(fitted: list[float], held_out: list[float]) -> None:
    mean = float(np.exp(np.mean(fitted)))
    for trial in with_common_scale(swims(fitted) + swims(held_out, "holdout"), LENGTH_M):
        assert trial.metres_per_px == pytest.approx(mean * TRUE_M_PER_PX)
        assert trial.speed == pytest.approx(0.1 * mean)
        assert trial.start_velocity == pytest.approx([-0.1 * mean, 0.0, 0.3])
        assert trial.position_m == pytest.approx(mean * straight_swim(20))
        assert trial.head.forward_m[-1] == pytest.approx(0.19 * mean)
        assert not trial.flags


@given(of=errors, seed=st.integers(0, 100))
def test_their_order_does_not_matter(of: list[float], seed: int) -> None:
    trials = swims(of)
    shuffled = [trials[i] for i in np.random.default_rng(seed).permutation(len(trials))]
    found, others = (
        {trial.name: trial.speed for trial in with_common_scale(each, LENGTH_M)} for each in (trials, shuffled)
    )
    assert found == others


@pytest.mark.parametrize("off", [-0.5, -0.11, 0.11, 0.7])
@pytest.mark.parametrize("role", ["fit", "holdout"])
def test_a_swim_filmed_otherwise_keeps_its_own_scale_and_says_so(role: str, off: float) -> None:
    others = swims([0.01, -0.02, 0.0])
    *found, odd = with_common_scale([*others, swim("odd", off, role)], LENGTH_M)
    assert odd.speed == 0.1 * np.exp(off)
    assert kinds(odd) == ["scale_apart"]
    assert [trial.speed for trial in found] == [trial.speed for trial in with_common_scale(others, LENGTH_M)]
    assert not any(trial.flags for trial in found)


def test_the_held_out_swims_tell_which_of_two_fitted_ones_is_off() -> None:
    trials = [*swims([0.0, 0.11]), *swims([0.01, -0.01], "holdout")]
    found = with_common_scale(trials, LENGTH_M)
    assert [kinds(trial) for trial in found] == [[], ["scale_apart"], [], []]
    assert [trial.speed for trial in found] == pytest.approx([0.1, 0.1 * np.exp(0.11), 0.1, 0.1])


def test_where_no_fitted_swim_is_like_the_others_these_share_their_own_mean() -> None:
    found = with_common_scale([*swims([0.4]), *swims([0.02, 0.0], "holdout")], LENGTH_M)
    assert [kinds(trial) for trial in found] == [["scale_apart"], [], []]
    assert [trial.speed for trial in found[1:]] == pytest.approx([0.1 * np.exp(0.01)] * 2)


def test_of_two_fitted_swims_that_disagree_both_are_flagged() -> None:
    found = with_common_scale(swims([0.0, 0.2]), LENGTH_M)
    assert [kinds(trial) for trial in found] == [["scale_apart"]] * 2
    assert [trial.speed for trial in found] == [0.1, 0.1 * np.exp(0.2)]
