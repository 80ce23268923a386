"""Hypotheses are weighed as they should be: what is there is found, what is not is not, and chances come true."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from diagnosis.constants import SIZES
from diagnosis.effect_response import effect_responses
from diagnosis.evidence import Priors, Residual, gaussian_evidence, log_mass
from diagnosis.hypotheses import Hypothesis, Probabilities
from diagnosis.verdict import Verdict, verdict_of
from fitting.signatures import Signature
from tests.cases import later
from tests.diagnosis.rows import DIRECTIONS, SPACE, K, after, catalogue, hypotheses, made, signature

LAST = slice(K - 2, K)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng([seed, 5]).standard_normal(K)


def after_all(left: np.ndarray) -> Probabilities:
    return after(hypotheses(left))


def chances(sets: dict[tuple[int, ...], float], other: float) -> dict[Hypothesis, float]:
    return {Hypothesis(present): chance for present, chance in sets.items()} | {Hypothesis((), True): other}


@pytest.mark.parametrize("strength", [8.0, -8.0, 25.0])
def test_an_effect_that_is_there_is_named(strength: float) -> None:
    found = after_all(noise(1) + strength * DIRECTIONS[4])
    assert sum(found.of.values()) == pytest.approx(1.0)
    assert found.marginal[4] > 0.8
    assert verdict_of(found).groups == (("effect_4",),)


def test_two_that_are_there_are_named_together() -> None:
    verdict = verdict_of(after_all(noise(2) + 9 * DIRECTIONS[2] - 8 * DIRECTIONS[7]))
    assert verdict.name == "named"
    assert {group[0] for group in verdict.groups} == {"effect_2", "effect_7"}


def test_two_that_look_alike_are_told_as_alternatives() -> None:
    verdict = verdict_of(after_all(noise(3) + 8 * DIRECTIONS[0]))
    assert verdict.name == "inseparable"
    assert set(verdict.groups[0]) == {"effect_0", "twin_of_0"}
    either = Probabilities(("a", "b"), chances({(): 0.0, (0,): 0.5, (1,): 0.2, (0, 1): 0.25}, other=0.05))
    assert verdict_of(either) == Verdict("inseparable", (("a", "b"),))  # they may act together all the same


def test_an_effect_of_one_sign_does_not_explain_the_other() -> None:
    there, not_there = (after_all(noise(4) + s * DIRECTIONS[10]) for s in (9.0, -9.0))
    assert there.marginal[10] > 0.75
    assert not_there.marginal[10] < 0.2


def test_a_form_explains_only_strengths_near_those_that_were_tried() -> None:
    """Strong, the effect goes another way; a little of that other way is not this effect."""
    strengths = np.array([-30.0, -10.0, 10.0, 30.0])[:, None]
    rows = strengths * DIRECTIONS[1] + np.where(strengths == 30.0, 30.0, 0.0) * DIRECTIONS[2]
    bent = Signature(made("bent"), strengths, rows, np.zeros((4, 0)))
    weak, strong, sideways = (
        after(hypotheses(noise(12) + left, [bent, signature("plain", DIRECTIONS[5])])).marginal[0]
        for left in (8 * DIRECTIONS[1], 35 * (DIRECTIONS[1] + DIRECTIONS[2]), 6 * (DIRECTIONS[1] + DIRECTIONS[2]))
    )
    assert min(weak, strong) > 0.8
    assert sideways < 0.5


def test_what_no_effect_looks_like_is_unexplained() -> None:
    strange = np.linalg.qr(np.vstack([DIRECTIONS, np.random.default_rng(6).standard_normal((8, K))]).T)[0].T[12:]
    found = after_all(noise(5) + 7 * strange.sum(axis=0))
    assert found.other > 0.5
    assert verdict_of(found).name == "unexplained"


@pytest.mark.parametrize("seed", [20, 21, *later(*range(22, 28))])
def test_noise_alone_is_no_gap(seed: int) -> None:
    assert verdict_of(after_all(noise(seed))).name == "no_gap"


@pytest.mark.long
def test_chances_come_true() -> None:
    """Sessions drawn as they are believed to be: nothing, or one effect of a size from just seen to clear."""
    random, told, true = np.random.default_rng(7), [], []
    for seed in range(300):
        left, present = noise(100 + seed), None
        if random.random() < 0.5:
            present = int(random.integers(10))
            left = left + random.choice([-1, 1]) * np.exp(random.uniform(0.0, 3.0)) * DIRECTIONS[present]
        chances = after_all(left).marginal[:10]
        told.append(chances)
        true.append(np.arange(10) == (-1 if present is None else present))
    p, hit = np.concatenate(told), np.concatenate(true)
    for low, high in ((0.02, 0.3), (0.3, 0.7), (0.7, 1.0)):
        bin_ = (p >= low) & (p < high)
        if bin_.sum() >= 8:
            error = np.sqrt(p[bin_].mean() * (1 - p[bin_].mean()) / bin_.sum())
            assert abs(hit[bin_].mean() - p[bin_].mean()) < 0.08 + 3 * error


def test_what_only_looks_like_an_effect_counts_as_unknown() -> None:
    sets = {Hypothesis((0,)): 0.5, Hypothesis((0, 1), True): 0.4, Hypothesis(()): 0.1}
    found = Probabilities(("a", "b"), sets, look_alike=np.array([[0.25, 0.0], [1.0, 3.0]]))
    assert found.marginal == pytest.approx([0.5 * 0.8 + 0.4 * 0.5, 0.4 * 0.25])
    assert found.other == pytest.approx(0.5 * 0.2 + 0.4 * 0.5 * 0.75)
    assert found.any_seen([0]) == pytest.approx(0.9)


def test_a_name_that_a_gap_only_looks_like_is_not_said() -> None:
    """Both look like the first effect, by 0.99 and by 0.9 of their length; of the second too much is something else."""
    aside = np.random.default_rng(3).standard_normal((4, K)) @ (np.eye(K) - DIRECTIONS.T @ DIRECTIONS)
    aside = aside.sum(axis=0) / np.linalg.norm(aside.sum(axis=0))
    near, far = (after_all(noise(1) + 40 * (cos * DIRECTIONS[4] + np.sqrt(1 - cos**2) * aside)) for cos in (0.995, 0.8))
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
    odds = np.array([[1.2, 0.0], [0.0, 0.0]])
    looked = Probabilities(("a", "b"), {Hypothesis((0, 1)): 0.65, Hypothesis((0,)): 0.35}, look_alike=odds)
    assert verdict_of(looked).name == "unexplained"  # the sure one may as well be something that looks like it


def test_what_changes_frequencies_alone_is_no_chance_likeness() -> None:
    """Beside it something else is amiss with the features, of which the first 98 numbers are."""
    clock = signature("clock", np.eye(K)[K - 1])
    others, strange = catalogue()[:3], np.random.default_rng(3).standard_normal(K)
    strange[K - 2 :] = 0.0
    effects, left = effect_responses([clock, *others], SPACE), noise(6) + 40 * np.eye(K)[K - 1] + 4 * strange
    like_any = Residual.of(SPACE, left, np.eye(K), effects, LAST)
    known, unknown = (
        after(replace(hypotheses(left, [clock, *others], not_features=beside), like_any=like_any)).marginal[0]
        for beside in (LAST, slice(0, 0))
    )
    assert known > 0.9
    assert unknown < 0.8


@pytest.mark.parametrize(("low", "high"), [(-1.0, 2.0), (0.0, np.inf), (3.0, 4.0), (-4.0, -3.0), (-np.inf, np.inf)])
def test_the_mass_between_two_ends_is_that_of_the_normal(low: float, high: float) -> None:
    assert np.exp(log_mass(np.array(low), np.array(high))) == pytest.approx(norm.sf(low) - norm.sf(high))


@pytest.mark.parametrize("other", [False, True])
def test_the_evidence_is_that_of_the_normal_distribution_averaged_over_sizes(
    monkeypatch: pytest.MonkeyPatch, other: bool
) -> None:
    """Of two effects that may be as strong as any and whose forms are right."""
    effects = effect_responses([signature(f"effect_{i}", DIRECTIONS[i], -1e5, 1e5) for i in (0, 1)], SPACE)
    residual = Residual.of(SPACE, noise(2) + 12 * DIRECTIONS[0], np.eye(K), effects)
    responses = [each.linear[0] for each in effects]
    columns = np.hstack([residual.turn @ each.columns / each.size for each in responses])
    q, densities = len(residual.value), []
    monkeypatch.setattr("diagnosis.evidence.SIZES", few := np.array([1.0, 64.0]))
    for own in product(few, few, few if other else [0.0]):
        covariance = np.diag(1 + own[2] ** 2 / q * residual.spread) + columns * np.square(own[:2]) @ columns.T
        densities.append(multivariate_normal(np.zeros(q), covariance).logpdf(residual.value))
    expected = np.logaddexp.reduce(densities) - np.log(len(densities))
    found = gaussian_evidence(residual, responses, other, Priors(form_error=(0.0,))).evidence - q / 2 * np.log(
        2 * np.pi
    )
    assert found == pytest.approx(expected, abs=0.02)


def test_places_add_what_their_columns_explain() -> None:
    """Beside one effect with the likeliest size, by the density of the normal distribution."""
    places = ((1.0, SPACE.projected(np.eye(K)[[7, 9]]).T),)
    found = hypotheses(noise(3) + 10 * DIRECTIONS[2] + 8 * np.eye(K)[7], places=places)
    residual = gaussian_evidence(found.like_any, [found.best[2]], False, found.priors)  # type: ignore[list-item]
    known = np.diag(residual.variance) + residual.columns @ residual.columns.T
    place = found.like_any.turn @ found.places[0][1]
    place /= np.linalg.norm(place)
    q, value = len(known), found.like_any.value
    with_place = [multivariate_normal(np.zeros(q), known + s**2 * place @ place.T).logpdf(value) for s in SIZES]
    gained = (
        np.logaddexp.reduce(with_place) - np.log(len(SIZES)) - multivariate_normal(np.zeros(q), known).logpdf(value)
    )
    alone = found.evidence((2,), other=False)
    assert found.at_places((2,))[0] - alone == pytest.approx(gained - np.log(2), abs=1e-6)
