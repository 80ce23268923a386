"""Shares of groups: closed forms."""

import numpy as np
import pytest

from diagnosis.ridge import GROUPS, _moved, group_of, shapley, smallest, subsets
from swimmer.effects import catalogue

NAMES = ("a", "b", "c")


def test_every_effect_has_a_group() -> None:
    found = {group_of(effect) for effect in catalogue().values()}
    assert found == set(GROUPS)


def test_shares_of_what_adds_up_are_its_parts_and_of_what_needs_both_are_equal() -> None:
    parts = {"a": 1.0, "b": 2.0, "c": -0.5}
    adding = {subset: np.array([sum(parts[name] for name in subset)]) for subset in subsets(NAMES)}
    assert {name: float(share[0]) for name, share in shapley(adding, NAMES).items()} == pytest.approx(parts)
    both = {subset: np.array([float({"a", "b"} <= subset)]) for subset in subsets(NAMES)}
    found = shapley(both, NAMES)
    assert [float(found[name][0]) for name in NAMES] == pytest.approx([0.5, 0.5, 0.0])


def test_the_smallest_set_that_does_as_well_is_told() -> None:
    trials = np.array([1.0, 2.0, 3.0])
    errors = {subset: np.array([trials * (1.0 if "b" in subset else 2.0)]) for subset in subsets(NAMES)}
    errors[frozenset(NAMES)] = errors[frozenset(NAMES)] - 0.01 * trials  # worse beyond one standard error without
    errors[frozenset({"a", "b"})] = errors[frozenset(NAMES)]
    assert smallest(errors, frozenset(NAMES), NAMES) == ("a", "b")


def test_what_is_left_out_is_made_up_for_where_the_rest_can() -> None:
    """A coefficient that does the same in the fitted trials takes over; what nothing else does is lost."""
    white = np.column_stack([np.eye(6)[:, :5] * 100, 300 * np.eye(6)[:, 0], 100 * np.eye(6)[:, 5]])
    whose = np.array([""] * 5 + ["tendons", "structure"])
    points = np.array([[0, 0, 0, 0, 0, 2.0, 1.0]])
    moved = _moved(white, np.full(7, 10.0), whose, frozenset({"structure"}), points)
    assert moved[0] == pytest.approx([6.0, 0, 0, 0, 0, -2.0, 0.0], rel=1e-3, abs=1e-9)
    assert _moved(white, np.full(7, 10.0), whose, frozenset({"structure", "tendons"}), points) == pytest.approx(0.0)
    lost = _moved(white, np.full(7, 10.0), whose, frozenset({"tendons"}), points)
    assert lost[0] == pytest.approx([0, 0, 0, 0, 0, 0, -1.0])
