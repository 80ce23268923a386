"""What acts together must hold against the real simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import block_diag, solve_triangular
from scipy.stats import norm

from diagnosis.constants import WIDER
from diagnosis.evidence import Priors
from diagnosis.pruning import log_evidence, log_odds, pruned
from diagnosis.refit import Refit, refit
from swimmer.effects import catalogue
from tests.diagnosis.grounds import ARM, ground
from tests.diagnosis.rows import made


@lru_cache(maxsize=4)
def with_effects(*names: str) -> Refit:
    effects = [catalogue()[name] for name in names]
    return refit(ground("shorter"), effects, np.zeros(len(effects)), rounds=4)


def refitting(names: Sequence[str]) -> Refit:
    return with_effects(*names)


@pytest.fixture(scope="module")
def both() -> Refit:
    return with_effects("crank_arm_error", "bend_offset")


@pytest.mark.long
def test_what_is_not_there_goes_and_what_is_there_stays(both: Refit) -> None:
    found = pruned(ground("shorter"), both, refitting, Priors(), 33)
    assert [effect.name for effect in found.best.effects] == ["crank_arm_error"]
    assert found.best.values[0] == pytest.approx(ARM, abs=0.006)
    assert list(found.gone) == ["bend_offset"]
    assert found.gone["bend_offset"] < 0
    assert not found.kept


@pytest.mark.parametrize("count", [1, 14])
def test_parameters_of_which_the_swims_say_nothing_weigh_nothing(count: int) -> None:
    at = ground("shorter")
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
    assert pruned(ground("shorter"), alone, never, Priors(), 33) == (alone, {}, {})


def with_third(
    monkeypatch: pytest.MonkeyPatch, share: float, does: float = 1.0, told: float = 0.1, strength: float = 1.0
) -> tuple[Refit, list[Refit]]:
    """The arm and what is made up: it leaves less by a share of what the arm does; and both, each without the other.

    Args:
        monkeypatch: for what the made-up effect would do.
        share: of the length of what the arm does, along what the arm leaves.
        does: the same, of what it does to the swims as the evidence is told.
        told: how well its strength is known, in standard deviations of its prior.
        strength: in these.
    """
    at, arm, idle = ground("shorter"), with_effects("crank_arm_error"), made("idle")
    moved = at.left - arm.left
    long = np.linalg.norm(solve_triangular(at.space.root, moved, lower=True))
    leaves = np.linalg.norm(solve_triangular(at.space.root, arm.left, lower=True))
    sd = idle.parameters[0].sd
    fit = replace(
        arm,
        effects=(*arm.effects, idle),
        values=np.append(arm.values, strength * sd),
        left=(1 - share * long / leaves) * arm.left,
        covariance=block_diag(arm.covariance, [[(told * sd) ** 2]]),
        taken=np.append(arm.taken, WIDER * sd),
    )
    of_idle = does * share * long * arm.left / at.space.length(arm.left)
    rows = np.array([at.left, at.left, fit.left + of_idle])  # nothing; without the arm; without the other
    monkeypatch.setattr("diagnosis.pruning.left_at", lambda *_args: rows)
    plain, known = Refit.plain(at), fit.covariance[-1:, -1:]
    alone = replace(
        plain,
        effects=(idle,),
        values=fit.values[-1:],
        covariance=block_diag(plain.covariance, known),
        taken=np.append(plain.taken, fit.taken[-1]),
    )
    return fit, [alone, arm]


@pytest.mark.parametrize(("share", "sure", "believed"), [(0.2, (8, 12), (-3, 2)), (0.8, (20, 40), (5, 40))])
def test_what_is_little_beside_others_may_be_what_forms_have_wrong(
    monkeypatch: pytest.MonkeyPatch, share: float, sure: tuple[float, float], believed: tuple[float, float]
) -> None:
    fit, fewer = with_third(monkeypatch, share)
    right = log_odds(ground("shorter"), fit, fewer, replace(Priors(), alike=1e-9), 33)[1]
    doubted = log_odds(ground("shorter"), fit, fewer, Priors(), 33)[1]
    assert sure[0] < right < sure[1]
    assert believed[0] < doubted < believed[1]


def test_a_twin_that_diverges_without_an_effect_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    fit, fewer = with_third(monkeypatch, share=0.2)
    rows = np.full((3, len(fit.left)), np.nan)
    monkeypatch.setattr("diagnosis.pruning.left_at", lambda *_args: rows)
    assert (log_odds(ground("shorter"), fit, fewer, Priors(), 33) > 5).all()


@pytest.mark.parametrize("multiple", [0.03, 0.3, 1.0])
def test_a_narrower_prior_weighs_as_the_exact_formula_has_it(monkeypatch: pytest.MonkeyPatch, multiple: float) -> None:
    """What is seen of one strength is normal: by how much more probable it is with a prior than with another."""
    strength, told, taken = 1.0, 0.4, WIDER
    fit, _ = with_third(monkeypatch, share=0.2, told=told, strength=strength)
    seen = 1 / (told**-2.0 - taken**-2.0)  # variance of what the swims alone say
    said = strength * seen / told**2
    exact = norm.logpdf(said, 0, np.hypot(np.sqrt(seen), multiple)) - norm.logpdf(said, 0, np.hypot(np.sqrt(seen), 1.0))
    found = [log_evidence(ground("shorter"), fit, narrowed) for narrowed in ({"idle": multiple}, {})]
    assert found[0] - found[1] == pytest.approx(exact, abs=1e-6)


def test_the_arm_weighs_more_than_what_is_not_there() -> None:
    weights = [log_evidence(ground("shorter"), with_effects(name)) for name in ("crank_arm_error", "bend_offset")]
    assert weights[0] > weights[1] + 3
