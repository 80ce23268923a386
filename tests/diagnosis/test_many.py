"""Many effects at once: those are told without which a mixture of the others does far worse, and no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.evidence import Hypotheses
from diagnosis.forms import shown
from diagnosis.many import standing
from diagnosis.probabilities import Probabilities
from diagnosis.row import Row
from diagnosis.verdict import verdict_of
from tests.diagnosis.rows import DIRECTIONS, SPACE, K, catalogue, hypotheses

ACTING = (1, 2, 3, 4, 5, 6, 8, 9)  # of those that have nothing to do with each other


def asked(left: np.ndarray) -> Hypotheses:
    signatures = catalogue()
    effects = shown(signatures, SPACE)

    def lacking(effect: int) -> Row:
        return Row.of(SPACE, left, np.eye(K), [each for number, each in enumerate(effects) if number != effect])

    return replace(hypotheses(left, signatures), lacking=lacking)


def gap(seed: int, sizes: dict[int, float]) -> np.ndarray:
    random = np.random.default_rng([seed, 31])
    signs = random.choice([-1.0, 1.0], len(DIRECTIONS))
    noise = random.standard_normal(K)
    return np.asarray(noise + sum(size * signs[i] * DIRECTIONS[i] for i, size in sizes.items()))


def test_of_many_those_stand_that_are_large_and_no_other() -> None:
    for seed in range(4):
        found = asked(gap(seed, dict.fromkeys(ACTING, 30.0)))
        stands = standing(found, ())
        assert set(stands) == set(ACTING)
        assert all(chance > 0.9 for chance in stands.values())
    beside_its_twin = asked(gap(2, dict.fromkeys((0, *ACTING), 30.0)))  # of the first, which no mixture misses
    assert set(standing(beside_its_twin, ())) <= set(ACTING)


def test_they_are_told_and_said_up_to_as_many_as_may_be_said_at_once() -> None:
    found = Probabilities.after(asked(gap(1, dict.fromkeys(ACTING, 30.0))))
    acting = [found.names[i] for i in ACTING]
    assert all(found.marginal[i] > 0.9 for i in ACTING)
    assert found.marginal[7] < 0.1
    verdict = verdict_of(found)
    assert verdict.name == "named"
    assert set(verdict.effects) <= set(acting)
    assert sum(found.of.values()) < 1 + 1e-9


def test_a_gap_without_structure_is_no_mixture() -> None:
    random = np.random.default_rng(5)
    scattered = 10.0 * random.standard_normal(K)
    assert standing(asked(scattered), ()) == {}
    assert verdict_of(Probabilities.after(asked(scattered))).name == "unexplained"
