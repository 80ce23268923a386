"""One camera has one scale: what boxes do to nose and neck of one swim does not make that swim faster."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.picture_scale import at_scale, head_marker_columns, scale_sd, with_common_scale
from fitting.trial import MeasuredTrial
from fitting.trial_model import TrialModel, sensitivities_together
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin
from tests.fitting.swims import MARKERS, by_hand, filmed, head_frame_of, straight_swim

LENGTH_M = 0.142
TRUE_M_PER_PX = 0.001
errors = st.lists(st.floats(-0.025, 0.025), min_size=1, max_size=6)


def swim(name: str, error: float, role: str = "fit", longer: float = 0.0) -> MeasuredTrial:
    """A swim of 0.1 m/s whose boxes make its own scale wrong by a share; its body may be longer in the picture."""
    by = np.exp(error)
    position_m = by * (1 + longer) * straight_swim(20)
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


AT = np.array(PLAUSIBLE_COEFFICIENTS, float)


def model_of(trial: MeasuredTrial, length_m: float | None) -> TrialModel:
    """The twin as described, beside a swim of a session with that distance from nose to neck."""
    return TrialModel.of(exact_twin(1), replace(trial, scale_length_m=length_m))


def columns_of(model: TrialModel) -> np.ndarray:
    return head_marker_columns(model, sensitivities_together([model], AT)[0])


@pytest.fixture(scope="module")
def swum() -> MeasuredTrial:
    return exact_swims(hz=(1.0,), seconds=4.0)[0]


@pytest.mark.parametrize("off", [-0.05, 0.03])
def test_a_neck_that_sits_elsewhere_moves_features_as_a_robot_made_so(swum: MeasuredTrial, off: float) -> None:
    other = ROBOT.with_scale_length((1 + off) * ROBOT.scale_length_m)
    column = columns_of(model_of(swum, other.scale_length_m))[:, -1] * np.sqrt(2)
    plain, moved = (
        TrialModel.of(exact_twin(1).of_robot(robot), swum).simulated(AT[None])[0] for robot in (ROBOT, other)
    )
    assert column == pytest.approx(moved - plain, abs=0.05 * np.abs(moved - plain).max())
    assert np.abs(moved - plain).max() > 0.8 * abs(off) * ROBOT.scale_length_m


@pytest.mark.parametrize("off", [-0.08, 0.055])
def test_a_scale_that_is_off_is_among_what_nose_and_neck_explain(swum: MeasuredTrial, off: float) -> None:
    enlarged = at_scale(swum, (1 + off) * swum.metres_per_px)
    model = model_of(swum, (1 + off) * ROBOT.scale_length_m)
    change = TrialModel.of(exact_twin(1), enlarged).measured - TrialModel.of(exact_twin(1), swum).measured
    explained = [
        columns @ np.linalg.lstsq(columns, change)[0] for columns in (columns_of(model), columns_of(model)[:, :4])
    ]
    left, as_before = (np.linalg.norm(change - each) / np.linalg.norm(change) for each in explained)
    assert left < 0.02
    assert as_before > 0.15  # by errors of a ruler alone, however large


def test_where_session_and_robot_agree_nothing_is_added(swum: MeasuredTrial) -> None:
    alike, unknown = (columns_of(model_of(swum, length_m)) for length_m in (ROBOT.scale_length_m, None))
    assert np.array_equal(alike, unknown)
    assert not alike[:, 4:].any()
    assert scale_sd(swum, LENGTH_M) < 0.03 < scale_sd(replace(swum, scale_length_m=0.15), LENGTH_M)


@pytest.mark.parametrize(("longer", "told"), [(0.08, True), (-0.08, True), (0.03, False)])
@pytest.mark.parametrize("role", ["fit", "holdout"])
def test_a_body_that_is_longer_in_the_picture_keeps_its_own_scale(longer: float, told: bool, role: str) -> None:
    true = swims([0.01, -0.02, 0.0])
    odd = swim("odd", 0.04, role, longer)  # nose and neck alone may err by as much
    *found, last = with_common_scale([*true, odd], LENGTH_M)
    assert kinds(last) == ["scale_apart"] * told
    assert not told or f"{100 * abs(longer):.0f} % {'longer' if longer > 0 else 'shorter'}" in last.flags[0].message
    assert (last.speed == odd.speed) == told
    assert not any(trial.flags for trial in found)
