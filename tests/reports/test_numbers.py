"""How numbers are printed."""

import math

import pytest

from reports.words import counted, in_mm, listed, percent, shown, significant


@pytest.mark.parametrize("nothing", [None, math.nan, math.inf])
def test_what_is_not_known_is_a_dash(nothing: float | None) -> None:
    assert {shown(nothing), significant(nothing), in_mm(nothing), percent(nothing)} == {"–"}


def test_minus_is_a_minus_and_zero_has_no_sign() -> None:
    assert [shown(-1.25, 2), shown(-0.001, 1), shown(0.04, 1, signed=True)] == ["−1.25", "0.0", "0.0"]
    assert in_mm(0.0031, signed=True) == "+3.1"


def test_a_share_is_whole_only_when_nothing_is_missing() -> None:
    assert [percent(1.0), percent(0.99999), percent(0.5), percent(0.0)] == ["100 %", "99.9 %", "50.0 %", "0 %"]


def test_lists_read_as_sentences() -> None:
    assert [listed([]), listed(["a"]), listed(["a", "b", "c"])] == ["", "a", "a, b and c"]
    assert listed(list("abcdefgh"), most=3) == "a, b, c and 5 more"
    assert [counted(1, "trial"), counted(0, "trial")] == ["1 trial", "0 trials"]
