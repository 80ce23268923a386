"""What acts together must hold against the real simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import block_diag

from diagnosis.constants import WIDER
from diagnosis.evidence import Priors
from diagnosis.refit import Refit, refit_from
from diagnosis.verdict import backward_elimination, log_evidence
from swimcal.effects.catalogue import catalogue
from tests.diagnosis.linear_models import ARM, linear
from tests.diagnosis.rows import made


@lru_cache(maxsize=4)
def with_effects(*names: str) -> Refit:
    effects = [catalogue()[name] for name in names]
    return refit_from(linear("shorter"), effects, np.zeros(len(effects)), rounds=4)


def refitting(names: Sequence[str]) -> Refit:
    return with_effects(*names)


@pytest.fixture(scope="module")
def both() -> Refit:
    return with_effects("crank_arm_error", "bend_offset")


@pytest.mark.long
def test_what_is_not_there_goes_and_what_is_there_stays(both: Refit) -> None:
    best, gone = backward_elimination(linear("shorter"), both, refitting, Priors(), 33)
    assert [effect.name for effect in best.effects] == ["crank_arm_error"]
    assert best.values[0] == pytest.approx(ARM, abs=0.006)
    assert gone == ("bend_offset",)


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 14])
def test_parameters_of_which_the_swims_say_nothing_weigh_nothing(count: int) -> None:
    at = linear("shorter")
    plain, idle = Refit.plain(at), made("idle")
    idle.parameters = tuple(idle.parameters[0]._replace(name=f"of_{number}") for number in range(count))
    wide = [WIDER * parameter.sd for parameter in idle.parameters]
    known = block_diag(plain.covariance, np.diag(np.square(wide)))  # no more than that
    with_idle = replace(
        plain, effects=(idle,), values=np.zeros(count), covariance=known, taken=np.append(plain.taken, wide)
    )
    assert log_evidence(at, with_idle) == pytest.approx(log_evidence(at, plain), abs=1e-6)


def test_a_single_effect_is_not_asked() -> None:
    def never(_names: Sequence[str]) -> Refit:
        raise AssertionError

    alone = with_effects("crank_arm_error")
    assert backward_elimination(linear("shorter"), alone, never, Priors(), 33) == (alone, ())


def test_the_arm_weighs_more_than_what_is_not_there() -> None:
    weights = [log_evidence(linear("shorter"), with_effects(name)) for name in ("crank_arm_error", "bend_offset")]
    assert weights[0] > weights[1] + 3
