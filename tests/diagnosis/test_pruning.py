"""What acts together must hold against the real simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import block_diag, solve_triangular

from diagnosis.evidence import Belief
from diagnosis.pruning import log_evidence, log_odds, log_weight, pruned
from diagnosis.refit import Refit, refit
from swimmer.effects import Effect, catalogue
from tests.diagnosis.grounds import ARM, ground
from tests.diagnosis.rows import Made

ARM_ERROR, BEND = catalogue()["crank_arm_error"], catalogue()["bend_offset"]


@lru_cache(maxsize=4)
def with_effects(*names: str) -> Refit:
    effects = [catalogue()[name] for name in names]
    return refit(ground("shorter"), effects, np.zeros(len(effects)), rounds=4)


def refitting(effects: Sequence[Effect]) -> Refit:
    return with_effects(*(effect.name for effect in effects))


@pytest.fixture(scope="module")
def both() -> Refit:
    return with_effects("crank_arm_error", "bend_offset")


@pytest.mark.long
def test_what_is_not_there_goes_and_what_is_there_stays(both: Refit) -> None:
    found = pruned(ground("shorter"), both, refitting, Belief(), 33)
    assert [effect.name for effect in found.best.effects] == ["crank_arm_error"]
    assert found.best.values[0] == pytest.approx(ARM, abs=0.006)
    assert list(found.gone) == ["bend_offset"]
    assert found.gone["bend_offset"] < 0
    assert not found.kept


@pytest.mark.parametrize("count", [1, 14])
def test_parameters_of_which_the_swims_say_nothing_weigh_nothing(count: int) -> None:
    at = ground("shorter")
    plain, idle = Refit.plain(at), Made("idle")
    idle.parameters = tuple(idle.parameters[0]._replace(name=f"of_{number}") for number in range(count))
    prior = np.diag([(5 * parameter.sd) ** 2 for parameter in idle.parameters])  # all that is known of them
    with_idle = replace(plain, effects=(idle,), values=np.zeros(count), covariance=block_diag(plain.covariance, prior))
    assert log_evidence(at, with_idle) == pytest.approx(log_evidence(at, plain), abs=1e-6)


def test_a_single_effect_is_not_asked() -> None:
    def never(_effects: Sequence[Effect]) -> Refit:
        raise AssertionError

    alone = with_effects("crank_arm_error")
    assert pruned(ground("shorter"), alone, never, Belief(), 33) == (alone, {}, {})


def third(share: float) -> Refit:
    """The arm, and what is made up to move the swims along what the arm leaves, by a share of what the arm does."""
    at, arm, idle = ground("shorter"), with_effects("crank_arm_error"), Made("idle")
    does, leaves = (
        np.linalg.norm(solve_triangular(at.space.root, row, lower=True)) for row in (at.left - arm.left, arm.left)
    )
    told = np.square(0.1 * idle.parameters[0].sd)[None, None]
    return replace(
        arm,
        effects=(*arm.effects, idle),
        values=np.append(arm.values, idle.parameters[0].sd),
        left=(1 - share * does / leaves) * arm.left,
        covariance=block_diag(arm.covariance, told),
    )


def test_what_is_little_beside_the_others_may_be_what_their_forms_have_wrong() -> None:
    """It gains e^9.3 with forms that are right; as believed, e^0.8. What does nearly as much as the arm stays sure."""
    at, arm = ground("shorter"), with_effects("crank_arm_error")
    right, believed = replace(Belief(), alike=1e-9), Belief()
    assert log_odds(at, third(0.2), arm, right, 33) > 8
    assert log_odds(at, third(0.2), arm, believed, 33) < 1
    assert log_odds(at, third(0.8), arm, believed, 33) > 5


def test_the_arm_weighs_more_than_what_is_not_there() -> None:
    weights = [
        log_weight(ground("shorter"), with_effects(name), Belief(), 33) for name in ("crank_arm_error", "bend_offset")
    ]
    assert weights[0] > weights[1] + 3
