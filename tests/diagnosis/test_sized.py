"""A row beside effects of a size is as probable as the normal distribution says that this makes."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from diagnosis.forms import shown
from diagnosis.row import Row
from diagnosis.sized import MOST_WRONG, Columns, Sized
from tests.diagnosis.rows import DIRECTIONS, SPACE, K, signature

SIZES, OTHER = np.array([[1.0, 4.0], [16.0, 4.0], [64.0, 1.0]]), np.array([0.0, 4.0, 16.0])
UNLIKE = 0.25


def columns() -> Columns:
    """Two effects that may be as strong as any, one of them there."""
    effects = shown([signature(f"effect_{i}", DIRECTIONS[i], -1e5, 1e5) for i in (0, 1)], SPACE)
    left = np.random.default_rng(2).standard_normal(K) + 12 * DIRECTIONS[0]
    return Columns.of(Row.of(SPACE, left, np.eye(K), effects), [each.forms[0] for each in effects])


def test_evidences_of_all_sizes_are_those_of_their_covariances() -> None:
    beside = columns()
    row, size = beside.row, beside.every
    unlike = beside.unlike(SIZES, OTHER, UNLIKE)
    expected = [
        multivariate_normal(np.zeros(len(row.left)), np.diag(1 + wrong * row.spread) + size * own**2 @ size.T).logpdf(
            row.left
        )
        for wrong, own in zip(unlike, SIZES, strict=True)
    ]
    found = beside.evidences(SIZES, OTHER, UNLIKE) - len(row.left) / 2 * np.log(2 * np.pi)
    assert found == pytest.approx(expected, abs=0.01)  # strengths stay where forms hold
    one_by_one = [Sized(beside, tuple(s), o, UNLIKE).evidence for s, o in zip(SIZES, OTHER, strict=True)]
    assert beside.evidences(SIZES, OTHER, UNLIKE) == pytest.approx(one_by_one)


def test_what_no_form_holds_goes_with_what_the_row_has_of_it() -> None:
    lengths = columns().lengths(np.array([[64.0, 64.0], [64.0, 1e-3], [1e-3, 64.0]]))
    assert lengths[1] == pytest.approx(12.0, rel=0.2)
    assert lengths[2] < 4
    assert lengths[0] == pytest.approx(np.hypot(*lengths[1:]), rel=0.03)


def test_it_has_a_limit() -> None:
    beside = columns()
    far = Columns.of(Row(beside.row.turn, 100 * beside.row.left, beside.row.spread), beside.forms)
    assert far.lengths(np.array([[1024.0, 1.0]])) == MOST_WRONG


def test_without_any_form_only_something_else_makes_a_row_likelier() -> None:
    row = columns().row
    nothing = Columns.of(row, ())
    evidences = nothing.evidences(np.zeros((3, 0)), np.array([0.0, 4.0, 1024.0]), UNLIKE)
    assert evidences[0] == pytest.approx(-0.5 * row.squares)
    assert evidences[1] > evidences[0] > evidences[2]
