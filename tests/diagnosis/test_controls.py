"""Controls: what is carried over is what swims have in common, and a placebo is no candidate."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from diagnosis.held_out import carried_over, placebo_for
from diagnosis.linear_model import LinearModel
from fitting.model.features import advanced
from tests.diagnosis.linear_models import linear

LENGTH = 138  # features of a swim of nine markers, its course among them


def gap_of(size_m: float, seed: int = 0) -> np.ndarray:
    """(g,) of the features of one: smooth along the body, as a gap of no particular cause is."""
    common = linear().generic[:LENGTH, :LENGTH]
    return size_m * np.linalg.cholesky(common) @ np.random.default_rng(seed).standard_normal(LENGTH)


def with_left(gaps: list[np.ndarray]) -> LinearModel:
    """Gaps of features whose tail begins farthest left."""
    other: LinearModel = replace(linear())
    turned = [advanced(gap, float(phase)) for gap, phase in zip(gaps, linear().model.phase_rad, strict=True)]
    other.__dict__["residual"] = np.concatenate([*turned, np.zeros(len(gaps))])
    return other


def squares(at: LinearModel, left: np.ndarray) -> float:
    return float((at.whitened_swims(left) ** 2).sum())


def test_only_what_swims_have_in_common_is_carried_over() -> None:
    same = with_left([gap_of(5e-3)] * 2)
    assert squares(same, carried_over(same, same)) < 0.1 * squares(same, same.residual)
    fitted, other = with_left([gap_of(5e-3, 1), gap_of(5e-3, 2)]), with_left([gap_of(5e-3, 3), gap_of(5e-3, 4)])
    assert squares(other, carried_over(fitted, other)) > 0.8 * squares(other, other.residual)


def test_a_masked_marker_is_neither_corrected_nor_scored() -> None:
    masked, marker = with_left([gap_of(5e-3)] * 2), 3
    own = slice(1 + 14 * marker, 15 + 14 * marker)
    masked.__dict__["observed"] = np.ones(2 * LENGTH + 2, bool)
    masked.observed[own] = False
    masked.residual[own] = 0.0
    corrected = carried_over(masked, masked)
    np.testing.assert_array_equal(corrected[own], 0.0)
    assert len(masked.whitened_swims(corrected)) == 2 * LENGTH - 14
    assert squares(masked, corrected) < 0.1 * squares(masked, masked.residual)


def test_a_placebo_is_unlikely_not_named_and_as_free_as_the_named() -> None:
    forms = {"named": (1, 5.0), "likely": (1, 9.0), "weak": (1, 1.0), "strong": (1, 4.0), "free": (3, 8.0)}
    effects = [SimpleNamespace(linear=[SimpleNamespace(parameters=range(p), size=s)]) for p, s in forms.values()]
    hypotheses = SimpleNamespace(effects=effects, best=[1] * len(forms))
    chances = SimpleNamespace(names=tuple(forms), marginal=np.array([0.95, 0.4, 0.001, 0.001, 0.001]))
    assert placebo_for(hypotheses, chances, {"named"}) == "strong"  # type: ignore[arg-type]
    assert placebo_for(hypotheses, chances, {"named", "likely", "strong"}) == "free"  # type: ignore[arg-type]
    assert placebo_for(hypotheses, chances, set(forms)) is None  # type: ignore[arg-type]
