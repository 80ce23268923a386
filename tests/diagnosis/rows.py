"""Rows of a hundred numbers in which all that effects do is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from diagnosis.effect_response import effect_responses
from diagnosis.evidence import Hypotheses, Priors, Residual
from diagnosis.hypotheses import HypothesisWeights, Probabilities, posterior
from fitting.signatures import Signature, Whitened
from tests.fitting.signatures.made import Made

K = 100
SPACE = Whitened.of(np.eye(K), np.eye(K)[:, :5], np.full(5, 10.0))
DIRECTIONS = np.linalg.qr(np.random.default_rng(4).standard_normal((K, 12)))[0].T  # (12, k)


def made(name: str, low: float = -50.0, high: float = 50.0) -> Made:
    return Made(name, (low, high), sd=10.0)


def signature(name: str, direction: np.ndarray, low: float = -50.0, high: float = 50.0) -> Signature:
    """Linear, along a direction (k,)."""
    strengths = np.array([s for s in (-30.0, -10.0, 10.0, 30.0) if low <= s <= high])[:, None]
    return Signature(made(name, low, high), strengths, strengths * direction, np.zeros((len(strengths), 0)))


def catalogue() -> list[Signature]:
    """Ten that have nothing to do with each other, one with one sign, and one that is nearly the first."""
    plain = [signature(f"effect_{i}", DIRECTIONS[i]) for i in range(10)]
    common = 0.995 * DIRECTIONS[0] + np.sqrt(1 - 0.995**2) * DIRECTIONS[11]
    return [*plain, signature("one_sided", DIRECTIONS[10], low=0.0), signature("twin_of_0", common)]


def hypotheses(left: np.ndarray, signatures: list[Signature] | None = None, **more: Any) -> Hypotheses:
    """Of what is left (k,)."""
    effects = effect_responses(signatures or catalogue(), SPACE)
    like_any, loose = (Residual.of(SPACE, left, np.eye(K), like) for like in (effects, ()))
    return Hypotheses(like_any, loose, effects, Priors(), **more)


def after(found: Hypotheses) -> Probabilities:
    return posterior([(0.0, HypothesisWeights.of(found))], found)
