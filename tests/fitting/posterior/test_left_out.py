"""What is said of effects that the twin leaves out."""

from __future__ import annotations

import pytest

from fitting.posterior.left_out import left_out_flags
from tests.reports.posteriors import left_out

MOVES = (2.0, 0.5, -1.0, 0.0, 0.0)


def test_nothing_is_flagged_that_chance_makes() -> None:
    assert left_out_flags([]) == []
    assert left_out_flags([left_out("entrained_water", 2.0, 0.4, shows=2.0, moves=MOVES)]) == []


def test_an_effect_that_the_swims_ask_for_is_flagged_with_what_it_does() -> None:
    (flag,) = left_out_flags([left_out("entrained_water", 5.0, 1e-5, shows=2.0, moves=MOVES)])
    assert flag.kind == "effect_left_out"
    assert "entrained water (5.0 standard deviations, p 1e-05 for any of 1 that were tried)" in flag.message
    assert "With entrained water of 0.005 m blunt drag would be 5.0 of its standard deviations lower" in flag.message


def test_the_other_way_a_coefficient_is_higher() -> None:
    (flag,) = left_out_flags([left_out("scale_error", 5.0, 1e-5, shows=2.0, moves=(0.5, -2.0, 0.0, 0.0, 0.0))])
    assert "slender drag would be 5.0 of its standard deviations higher" in flag.message


def test_those_that_are_as_likely_are_named_with_it() -> None:
    asked = {"a": 5.0, "b": 4.9, "c": 4.0}
    (flag,) = left_out_flags([left_out(name, z, 1e-5, shows=2.0, moves=MOVES) for name, z in asked.items()])
    assert "leaves out: a or b (" in flag.message


@pytest.mark.parametrize(
    ("shows", "most", "hides"), [(2.0, 1.5, True), (4.0, 1.5, False), (2.0, 0.5, False), (2.0, -1.5, True)]
)
def test_what_hides_is_not_seen_and_moves_a_coefficient(shows: float, most: float, hides: bool) -> None:
    assert left_out("a", 0.0, 1.0, shows, (most, 0.0, 0.0, 0.0, 0.0)).hides == hides
