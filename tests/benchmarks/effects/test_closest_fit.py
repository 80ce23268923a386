"""The closest fit of some effects in a space that is small enough to know it."""

import numpy as np
import pytest

from benchmarks.effects.rows import closest_fit_of
from fitting.signatures import Signature, Whitened
from tests.fitting.signatures.made import Made

K = 9


def signature(name: str, rows: np.ndarray, *bounds: tuple[float, float]) -> Signature:
    """Linear: (p, k) rows per unit of each parameter."""
    values = np.vstack([np.eye(len(rows)), 3 * np.eye(len(rows))])
    return Signature(Made(name, *bounds), values, values @ rows, np.zeros((len(values), 0)))


@pytest.fixture
def space() -> Whitened:
    """Unit noise; coefficients move the first five numbers and have no prior to speak of."""
    return Whitened.of(np.eye(K), np.eye(K)[:, :5], np.full(5, 1e9))


def test_a_rival_in_the_same_direction_comes_within_its_bounds(space: Whitened) -> None:
    row = 2 * np.eye(K)[6]
    same = signature("same", np.eye(K)[6:7], (-5.0, 5.0))
    bound = signature("bound", np.eye(K)[6:7], (-5.0, 0.5))
    other = signature("other", np.eye(K)[7:8], (-5.0, 5.0))
    one_sided = signature("one_sided", -np.eye(K)[6:7], (0.0, 5.0))
    found = {each.effect.name: closest_fit_of(space, row, [each]) for each in (same, bound, other, one_sided)}
    assert found["same"].distance == pytest.approx(0.0, abs=1e-6)
    assert found["same"].values[0] == pytest.approx([2.0])
    assert found["bound"].distance == pytest.approx(1.5)
    assert found["other"].distance == pytest.approx(2.0)
    assert found["one_sided"].distance == pytest.approx(2.0)


def test_a_rival_of_two_parameters_uses_both(space: Whitened) -> None:
    both = signature("both", np.eye(K)[6:8], (-5.0, 5.0), (-5.0, 5.0))
    rival = closest_fit_of(space, np.eye(K)[6] - 2 * np.eye(K)[7] + np.eye(K)[8], [both])
    assert rival.values[0] == pytest.approx([1.0, -2.0])
    assert rival.distance == pytest.approx(1.0)


def test_a_rival_that_turns_is_nearest_on_the_right_stretch(space: Whitened) -> None:
    """Along one direction while it is weak and along another once it is strong; no single slope comes near both."""
    bent = signature("bent", np.eye(K)[6:7], (0.0, 6.0))
    bent.features[1] = 3 * np.eye(K)[7]
    weak, strong = closest_fit_of(space, np.eye(K)[6], [bent]), closest_fit_of(space, 4 * np.eye(K)[7], [bent])
    assert (weak.distance, *weak.values[0]) == pytest.approx((0.0, 1.0), abs=1e-6)
    assert (strong.distance, *strong.values[0]) == pytest.approx((0.0, 4.0), abs=1e-6)
    assert closest_fit_of(space, 4 * np.eye(K)[6], [bent]).distance > 1.0  # so strong it is another


def test_two_effects_together_come_nearer_than_either(space: Whitened) -> None:
    one, other = (signature(str(i), np.eye(K)[i : i + 1], (-5.0, 5.0)) for i in (6, 7))
    values, distance, left = closest_fit_of(space, 2 * np.eye(K)[6] - np.eye(K)[7] + np.eye(K)[8], [one, other])
    assert [each.tolist() for each in values] == [pytest.approx([2.0]), pytest.approx([-1.0])]
    assert distance == pytest.approx(1.0)
    assert left == pytest.approx(np.eye(K)[8], abs=1e-6)
