"""What acts together must hold against the real simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import block_diag

from diagnosis.evidence import Belief
from diagnosis.pruning import log_evidence, log_weight, pruned
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
    assert list(found.log_odds) == ["bend_offset"]
    assert found.log_odds["bend_offset"] < 0


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
    assert pruned(ground("shorter"), alone, never, Belief(), 33) == (alone, {})


def test_the_arm_weighs_more_than_what_is_not_there() -> None:
    weights = [
        log_weight(ground("shorter"), with_effects(name), Belief(), 33) for name in ("crank_arm_error", "bend_offset")
    ]
    assert weights[0] > weights[1] + 3
