"""What a free decay and a motor's log say beside swims.

A decay tells of hinges and the clock, and of nothing that water or a motor does; a log tells a crank that turned
otherwise from a camera whose clock is wrong.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.discrepancy import discrepancy_for
from diagnosis.evidence import Priors
from diagnosis.experiments import _Pair, _with_a_decay
from diagnosis.hypotheses import Probabilities, average_hypotheses, error_sizes
from diagnosis.linear_model import LinearModel, free_decay_fits
from diagnosis.places import responses
from diagnosis.verdict import verdict_of
from diagnosis.where import OF_NO_MARKER, decompose
from fitting.signatures import Signature, signature_of
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from tests.cases import later
from tests.diagnosis.decays import decay
from tests.diagnosis.linear_models import AT, CAMERA, trials
from tests.fitting.exact_swims import ROBOT, exact_twin

OFF = 1.05  # times as fast as filmed the motors were told to turn
CLOCK, RATIO = "time_base_error", "drive_ratio_error"
TRIED = (CLOCK, RATIO, "stiffness_error", "joint_damping", "background_current")


@cache
def linear(stiffer: float = 0.0, damped: float = 0.0) -> LinearModel:
    """Swims of the robot as described, without commands, beside a decay of one that is not."""
    told, twin = [replace(trial, commanded_hz=None) for trial in trials()], exact_twin(1)
    rings = free_decay_fits([decay(stiffer, damped)], twin).believed
    discrepancy = discrepancy_for(FISHSIM_MARKERS, ROBOT)
    return LinearModel.of(told, twin, CAMERA, discrepancy, AT, rings=rings)


def signatures(at: LinearModel) -> list[Signature]:
    return [signature_of(catalogue()[name], at.model, CAMERA, at.at) for name in TRIED]


def seen(slower: float | None = None, logged: float | None = None) -> tuple[LinearModel, Probabilities]:
    """Of swims that beat slower than commanded; None without a decay or a log.

    Args:
        slower: times as fast as it should the clock goes by which a decay was filmed.
        logged: times the filmed speed of the first trial its log tells.
    """
    known = linear()
    told = [replace(each.trial, commanded_hz=OFF * each.trial.frequency.hz) for each in known.model.trials]
    if logged is not None:
        told[0] = replace(told[0], logged_hz=logged * told[0].frequency.hz)
    beside = tuple(replace(each, trial=trial) for each, trial in zip(known.model.trials, told, strict=True))
    rings = () if slower is None else free_decay_fits([decay(slower=slower)], exact_twin(1)).believed
    at = replace(known, model=type(known.model)(beside, rings))  # its slopes are found anew
    found = average_hypotheses(error_sizes(at, signatures(at)), signatures(at), Priors())
    return found.linear, found.probabilities


@pytest.mark.long
def test_its_numbers_end_the_row() -> None:
    at = linear(0.1, 0.3)
    assert at.model.of_rings == 2
    assert at.residual[-2:] == pytest.approx(np.log([1.1, 1.3]), abs=0.04)
    assert at.slopes[-2:] == pytest.approx(np.zeros((2, 5)))


@pytest.mark.long
def test_robots_that_are_a_little_off_move_it_with_the_features() -> None:
    """By 2 % in stiffness and in the tail's mass, and 5 % in damping; what else disturbs features does not matter."""
    at = linear()
    assert np.sqrt(np.diag(at.covariance)[-2:]) == pytest.approx([0.03, 0.055], abs=0.01)
    shared = at.covariance[: len(at.model.measured), -2:]
    robot = at.disturbances.robot @ at.model.ring_sensitivities.T
    assert shared == pytest.approx(robot)
    assert np.abs(robot).max() > 0
    assert np.linalg.eigvalsh(at.covariance).min() > 0


@pytest.mark.long
def test_water_and_motors_do_not_move_it() -> None:
    moved = {each.effect.name: np.abs(each.rows[:, -2:]).max() for each in signatures(linear())}
    assert moved[RATIO] == moved["background_current"] == 0.0
    assert min(moved[name] for name in (CLOCK, "stiffness_error", "joint_damping")) > 0.01


@pytest.mark.long
def test_hinges_within_what_is_doubted_of_them_are_no_effect() -> None:
    at = linear(0.03, -0.05)
    assert average_hypotheses(error_sizes(at, signatures(at)), signatures(at), Priors()).probabilities.null > 0.5


@pytest.mark.long
def test_it_speaks_for_a_clock_or_for_a_gear() -> None:
    """What rings as much too slow as the swims beat was filmed by a wrong clock. (These swims themselves deny that.)

    By little: hinges are doubted by 3 %, and so a clock is by half as much.
    """
    found = [seen(each)[1].marginal for each in (OFF, None, 1.0)]
    slow, none, right = (np.log(each[TRIED.index(CLOCK)] / each[TRIED.index(RATIO)]) for each in found)
    assert slow > none + 0.4
    assert none > right + 1.0


@pytest.mark.long
def test_the_split_by_stage_and_by_trial_counts_it_and_adds_up() -> None:
    at = linear(0.15, 0.5)
    where = decompose(at, responses(at), signatures(at)).shares
    assert where.by_stage["tail"] > 0.1
    assert where.by_trial["decay"] > 0.1
    for parts in (where.by_stage, where.by_trial, where.by_marker, where.by_axis, where.by_band):
        assert sum(parts.values()) == pytest.approx(1.0)
    assert where.by_band[OF_NO_MARKER[-1]] == pytest.approx(where.by_trial["decay"])


def test_one_that_must_not_be_believed_is_left_out() -> None:
    seen = decay()
    shaken = np.array(seen.position_m)
    shaken[:, ::2, 1] += 0.02 * np.sin(9 * seen.time_s)[:, None]
    found = free_decay_fits([replace(seen, position_m=shaken)], exact_twin(1))
    assert found.believed == ()
    assert "explains only" in found.left_out["decay"]


@cache
def without() -> LinearModel:
    """The same swims without a decay."""
    return replace(linear(), model=type(linear().model)(linear().model.trials))


def pair(*names: str) -> _Pair:
    """Each effect by a standard deviation of its first parameter."""
    one, other = (catalogue()[name] for name in names)
    strengths = [np.eye(len(each.parameters))[0] * each.parameters[0].sd for each in (one, other)]
    return _Pair((one, other), (strengths[0], strengths[1]), 0.0)


def test_it_is_recommended_where_it_would_tell_something() -> None:
    pairs = [pair("stiffness_error", "background_current"), pair(RATIO, "background_current")]
    (told,) = _with_a_decay(without(), pairs)
    assert told.separates == ("stiffness_error", "background_current")
    assert told.expected_error < 0.5


@pytest.mark.long
def test_without_a_log_these_swims_call_for_a_gear() -> None:
    """They swim as a fish does that beats as often as was filmed; that a clock is wrong is far from excluded."""
    linear, found = seen()
    assert linear.model.frequencies == 2
    assert found.marginal[1] > found.marginal[0] > 0.001
    assert found.any_seen([0, 1]) > 0.99


@pytest.mark.parametrize(("logged", "name"), [(OFF, CLOCK), *later((1.0, RATIO))])
def test_a_log_tells_clock_from_gear(logged: float, name: str) -> None:
    """By the log the crank turned as commanded, and the clock is wrong; or it turned as filmed."""
    linear, found = seen(logged=logged)
    assert linear.model.frequencies == 3
    assert verdict_of(found).groups == ((name,),)
