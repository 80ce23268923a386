"""Hypotheses are weighed as they should be: what is there is found, what is not is not, and chances come true."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.evidence import Hypotheses, Priors
from diagnosis.forms import shown
from diagnosis.probabilities import Hypothesis, Probabilities
from diagnosis.row import NONE, Row
from diagnosis.verdict import Verdict, verdict_of
from fitting.signatures import Signature
from tests.cases import later
from tests.diagnosis.rows import DIRECTIONS, SPACE, K, catalogue, hypotheses, made, signature

LAST = slice(K - 2, K)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng([seed, 5]).standard_normal(K)


def after(left: np.ndarray) -> Probabilities:
    return Probabilities.after(hypotheses(left))


def chances(sets: dict[tuple[int, ...], float], other: float) -> dict[Hypothesis, float]:
    return {Hypothesis(present): chance for present, chance in sets.items()} | {Hypothesis((), True): other}


@pytest.mark.parametrize("strength", [8.0, -8.0, 25.0])
def test_an_effect_that_is_there_is_named(strength: float) -> None:
    found = after(noise(1) + strength * DIRECTIONS[4])
    assert sum(found.of.values()) == pytest.approx(1.0)
    assert found.marginal[4] > 0.8
    assert verdict_of(found).groups == (("effect_4",),)


def test_two_that_are_there_are_named_together() -> None:
    verdict = verdict_of(after(noise(2) + 9 * DIRECTIONS[2] - 8 * DIRECTIONS[7]))
    assert verdict.name == "named"
    assert {group[0] for group in verdict.groups} == {"effect_2", "effect_7"}


def test_two_that_look_alike_are_told_as_alternatives() -> None:
    verdict = verdict_of(after(noise(3) + 8 * DIRECTIONS[0]))
    assert verdict.name == "inseparable"
    assert set(verdict.groups[0]) == {"effect_0", "twin_of_0"}
    either = Probabilities(("a", "b"), chances({(): 0.0, (0,): 0.5, (1,): 0.2, (0, 1): 0.25}, other=0.05))
    assert verdict_of(either) == Verdict("inseparable", (("a", "b"),))  # they may act together all the same


def test_an_effect_of_one_sign_does_not_explain_the_other() -> None:
    there, not_there = (after(noise(4) + s * DIRECTIONS[10]) for s in (9.0, -9.0))
    assert there.marginal[10] > 0.8
    assert not_there.marginal[10] < 0.2


def test_a_form_explains_only_strengths_near_those_that_were_tried() -> None:
    """Strong, the effect goes another way; a little of that other way is not this effect."""
    strengths = np.array([-30.0, -10.0, 10.0, 30.0])[:, None]
    rows = strengths * DIRECTIONS[1] + np.where(strengths == 30.0, 30.0, 0.0) * DIRECTIONS[2]
    bent = Signature(made("bent"), strengths, rows, np.zeros((4, 0)))
    weak, strong, sideways = (
        Probabilities.after(hypotheses(noise(12) + left, [bent, signature("plain", DIRECTIONS[5])])).marginal[0]
        for left in (8 * DIRECTIONS[1], 35 * (DIRECTIONS[1] + DIRECTIONS[2]), 6 * (DIRECTIONS[1] + DIRECTIONS[2]))
    )
    assert min(weak, strong) > 0.8
    assert sideways < 0.5


def test_what_no_effect_looks_like_is_unexplained() -> None:
    strange = np.linalg.qr(np.vstack([DIRECTIONS, np.random.default_rng(6).standard_normal((8, K))]).T)[0].T[12:]
    found = after(noise(5) + 7 * strange.sum(axis=0))
    assert found.other > 0.5
    assert verdict_of(found).name == "unexplained"


@pytest.mark.parametrize("seed", [20, 21, *later(*range(22, 28))])
def test_noise_alone_is_no_gap(seed: int) -> None:
    assert verdict_of(after(noise(seed))).name == "no_gap"


@pytest.mark.long
def test_chances_come_true() -> None:
    """Sessions drawn as they are believed to be: nothing, or one effect of a size from just seen to clear."""
    random, told, true = np.random.default_rng(7), [], []
    for seed in range(300):
        left, present = noise(100 + seed), None
        if random.random() < 0.5:
            present = int(random.integers(10))
            left = left + random.choice([-1, 1]) * np.exp(random.uniform(0.0, 3.0)) * DIRECTIONS[present]
        chances = after(left).marginal[:10]
        told.append(chances)
        true.append(np.arange(10) == (-1 if present is None else present))
    p, hit = np.concatenate(told), np.concatenate(true)
    for low, high in ((0.02, 0.3), (0.3, 0.7), (0.7, 1.0)):
        bin_ = (p >= low) & (p < high)
        if bin_.sum() >= 8:
            error = np.sqrt(p[bin_].mean() * (1 - p[bin_].mean()) / bin_.sum())
            assert abs(hit[bin_].mean() - p[bin_].mean()) < 0.08 + 3 * error


def test_an_effect_that_did_not_stand_hands_its_chance_on() -> None:
    sets = {Hypothesis((0,)): 0.2, Hypothesis((0, 1)): 0.5, Hypothesis((2,)): 0.1}
    sets |= {Hypothesis((1,), True): 0.1, Hypothesis((0,), True, 1): 0.1}
    before = Probabilities(("a", "b", "c"), sets)
    after = before.with_odds(["b"], -np.log(4.0), beside=["a"])
    beside = 0.2 * 0.8  # one fifth of where the other is seen, where both had been 0.6
    assert sum(after.of.values()) == pytest.approx(1.0)
    assert after.marginal == pytest.approx([0.8, 0.1 + beside * 5 / 6, 0.1])
    assert after.any_seen([1]) == pytest.approx(0.1 + beside)
    assert after.of[Hypothesis((0,))] == pytest.approx(0.2 + 0.6 - beside)
    assert after.of[Hypothesis((1,), True)] == 0.1  # that there is neither was not asked
    assert before.with_odds(["a"], 20.0, beside=["b"]).marginal == pytest.approx(before.marginal)


def test_a_name_that_a_gap_only_looks_like_is_not_said() -> None:
    """Both look like the first effect, by 0.99 and by 0.9 of their length; of the second too much is something else."""
    aside = np.random.default_rng(3).standard_normal((4, K)) @ (np.eye(K) - DIRECTIONS.T @ DIRECTIONS)
    aside = aside.sum(axis=0) / np.linalg.norm(aside.sum(axis=0))
    near, far = (after(noise(1) + 40 * (cos * DIRECTIONS[4] + np.sqrt(1 - cos**2) * aside)) for cos in (0.995, 0.8))
    assert verdict_of(near).groups == (("effect_4",),)
    assert far.any_seen([4]) > 0.9
    assert verdict_of(far).name == "unexplained"


@pytest.mark.parametrize(
    ("nothing", "named", "name"), [(0.015, 0.89, "named"), (0.1, 0.9, "no_gap"), (0.015, 0.5, "unexplained")]
)
def test_that_there_may_be_nothing_does_not_make_it_unexplained(nothing: float, named: float, name: str) -> None:
    other = 1 - nothing - named
    found = Probabilities(("a", "b"), chances({(): nothing, (0,): named}, other))
    assert verdict_of(found).name == name


def test_a_likely_name_is_said_beside_a_sure_one_and_not_alone() -> None:
    both = chances({(): 0.0, (0, 1): 0.65, (0,): 0.35}, other=0.0)
    found = Probabilities(("a", "b"), both)
    assert verdict_of(found).groups == (("a",), ("b",))
    assert verdict_of(found).without(["b"], found).groups == (("a",),)
    assert verdict_of(found).without(["a"], found).name == "unexplained"
    imitated = {Hypothesis((1,), True, 0): 0.36, Hypothesis((), True, 0): 0.19}
    looked = Probabilities(("a", "b"), {Hypothesis((0, 1)): 0.29, Hypothesis((0,)): 0.16} | imitated)
    assert verdict_of(looked).name == "unexplained"  # the sure one may as well be something that looks like it


def test_what_changes_frequencies_alone_is_no_chance_likeness() -> None:
    """Beside it something else is amiss with the features, of which the first 98 numbers are."""
    clock = signature("clock", np.eye(K)[K - 1])
    others, strange = catalogue()[:3], np.random.default_rng(3).standard_normal(K)
    strange[K - 2 :] = 0.0
    effects = shown([clock, *others], SPACE)
    left = noise(6) + 40 * np.eye(K)[K - 1] + 4 * strange
    ways = ((effects, NONE), (effects, LAST), ((), NONE))
    rows = tuple(Row.of(SPACE, left, np.eye(K), like, but) for like, but in ways)
    known, unknown = (
        Probabilities.after(Hypotheses(rows, effects, Priors(), frequencies)).marginal[0]
        for frequencies in (LAST, NONE)
    )
    assert known > 0.9
    assert unknown < 0.8
