"""What is said of effects that the twin leaves out."""

from __future__ import annotations

from fitting.signatures.score_tests import EffectsLeftOut, LeftOut
from session import Flag
from tests.reports.posteriors import left_out

MOVES = (2.0, 0.5, -1.0, 0.0, 0.0)


def flags(*tried: LeftOut) -> tuple[Flag, ...]:
    return EffectsLeftOut(tried, 5.4).flags


def test_nothing_is_flagged_that_chance_makes() -> None:
    assert flags() == ()
    assert flags(left_out("entrained_water", 2.0, 0.4, shows=2.0, moves=MOVES)) == ()


def test_an_effect_that_is_asked_for_is_flagged_with_what_it_does() -> None:
    (flag,) = flags(left_out("entrained_water", 5.0, 1e-5, shows=2.0, moves=MOVES))
    assert flag.kind == "effect_left_out"
    assert "entrained water (5.0 standard deviations, nominal p 1e-05 for any of 1 that were tried)" in flag.message
    assert "With entrained water of 0.005 m blunt drag would be 5.0 of its standard deviations lower" in flag.message


def test_what_moves_no_coefficient_is_flagged_if_it_may_be_what_does() -> None:
    still = left_out("marker_offset", 5.0, 1e-5, shows=5.0, moves=(0.5, 0.0, 0.0, 0.0, 0.0))
    other = left_out("scale_error", 4.9, 1e-5, shows=2.0, moves=MOVES)
    assert flags(still) == ()
    assert len(flags(still, other)) == 1


def test_it_is_reported_which_way_and_whether_beyond_what_intervals_allow() -> None:
    (flag,) = flags(left_out("scale_error", 5.0, 1e-5, shows=2.0, moves=(0.5, -2.0, 0.0, 0.0, 0.0)))
    assert "slender drag would be 5.0 of its standard deviations higher" in flag.message
    (flag,) = flags(left_out("crank_arm_error", 5.0, 1e-5, shows=2.0, moves=MOVES)._replace(allowed=True))
    assert "With crank arm error of 0.005 m, beyond what the intervals allow for, blunt drag" in flag.message


def test_those_that_are_as_likely_are_named_with_it() -> None:
    asked = {"a": 5.0, "b": 4.9, "c": 4.0, "d": -4.9}
    (flag,) = flags(*(left_out(name, z, 1e-5, shows=2.0, moves=MOVES) for name, z in asked.items()))
    assert "leaves out: a or b (" in flag.message
    (flag,) = flags(*(left_out(name, 5.0, 1e-5, shows=2.0, moves=MOVES) for name in "abcde"))
    assert "leaves out: a or b or c or 2 more (" in flag.message


def test_what_hides_and_is_not_asked_for_is_hidden() -> None:
    hides, asked = left_out("a", 1.0, 1.0, 2.0, MOVES), left_out("b", 5.0, 1e-5, 2.0, MOVES)
    assert EffectsLeftOut((asked, hides), 5.4).hidden == ("a",)
