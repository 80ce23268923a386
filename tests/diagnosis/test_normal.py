"""Densities of rows are those of the normal distributions they say they are, beside effects of any size and any gap."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from diagnosis.forms import shown
from diagnosis.generic import GenericGap, generic_covariance
from diagnosis.normal import Normal, log_mass, of_sizes
from diagnosis.row import Row
from diagnosis.sized import Columns, Sized
from tests.diagnosis.rows import DIRECTIONS, SPACE, K, signature

Q = 7


def drawn(columns: int, seed: int = 0) -> Normal:
    random = np.random.default_rng([seed, 3])
    return Normal(2 * random.standard_normal(Q), random.uniform(0.5, 2.0, Q), random.standard_normal((Q, columns)))


def density(normal: Normal) -> float:
    covariance = np.diag(normal.variance) + normal.columns @ normal.columns.T
    return float(multivariate_normal(np.zeros(Q), covariance).logpdf(normal.row)) + Q / 2 * float(np.log(2 * np.pi))


@pytest.mark.parametrize("columns", [0, 1, 3])
def test_densities_of_all_sizes_are_those_of_their_covariances(columns: int) -> None:
    drawn_from, random = drawn(columns), np.random.default_rng(6)
    variance, sizes = random.uniform(0.5, 2.0, (4, Q)), random.uniform(0.1, 9.0, (4, columns))
    found = of_sizes(drawn_from.row, variance, drawn_from.columns, sizes)
    each = [Normal(drawn_from.row, *one) for one in zip(variance, drawn_from.columns * sizes[:, None], strict=True)]
    assert found.log_density == pytest.approx([density(one) for one in each])
    assert found.mean == pytest.approx(np.array([one.mean for one in each]))
    assert found.covariance == pytest.approx(np.array([np.linalg.inv(one.precision) for one in each]))


@pytest.mark.parametrize("columns", [0, 2])
def test_what_one_more_column_adds_is_what_the_density_gains(columns: int) -> None:
    normal, more, sizes = drawn(columns), np.random.default_rng(4).standard_normal((Q, 3)), np.array([0.1, 5.0])

    def gained(column: np.ndarray) -> float:
        beside = Normal(normal.row, normal.variance, np.column_stack([normal.columns, column]))
        return density(beside) - density(normal)

    expected = np.array([[gained(size * one) for one in more.T] for size in sizes])
    assert normal.gained(more, sizes) == pytest.approx(expected)


def test_strengths_after_the_row_are_those_of_ridge_regression() -> None:
    normal = drawn(2)
    white = normal.columns / np.sqrt(normal.variance)[:, None]
    rows = np.vstack([white, np.eye(2)])
    expected = np.linalg.lstsq(rows, np.append(normal.row / np.sqrt(normal.variance), np.zeros(2)), rcond=None)[0]
    assert normal.mean == pytest.approx(expected)
    assert np.linalg.inv(normal.precision) == pytest.approx(np.linalg.inv(rows.T @ rows))


@pytest.mark.parametrize(("low", "high"), [(-1.0, 2.0), (0.0, np.inf), (3.0, 4.0), (-4.0, -3.0), (-np.inf, np.inf)])
def test_the_mass_between_two_ends_is_that_of_the_normal(low: float, high: float) -> None:
    assert np.exp(log_mass(np.array(low), np.array(high))) == pytest.approx(norm.sf(low) - norm.sf(high))


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


def test_without_any_form_only_something_else_makes_a_row_likelier() -> None:
    row = columns().row
    nothing = Columns.of(row, ())
    evidences = nothing.evidences(np.zeros((3, 0)), np.array([0.0, 4.0, 1024.0]), UNLIKE)
    assert evidences[0] == pytest.approx(-0.5 * row.squares)
    assert evidences[1] > evidences[0] > evidences[2]


ALONG_M = np.array([0.0, 0.142, 0.3, 0.45, 0.55])
TRIALS, NOISE_SD = 2, 1e-4
GENERIC = generic_covariance(ALONG_M, TRIALS, TRIALS)
KNOWN = NOISE_SD**2 * np.eye(len(GENERIC))


def gap_of(size_m: float, seed: int = 0) -> np.ndarray:
    """(k,) a gap of such a size, its frequencies included, and noise."""
    random = np.random.default_rng([seed, 3])
    gap = size_m * np.linalg.cholesky(GENERIC) @ random.standard_normal(len(GENERIC))
    return np.asarray(gap + NOISE_SD * random.standard_normal(len(gap)))


@pytest.mark.parametrize("size_m", [0.001, 0.01])
def test_its_size_is_found(size_m: float) -> None:
    gap = GenericGap(KNOWN, GENERIC, TRIALS).covariance(gap_of(size_m))
    sizes = np.sqrt(np.diag(gap)[:-TRIALS] / np.diag(GENERIC)[:-TRIALS])
    assert sizes == pytest.approx(size_m, rel=0.3)
