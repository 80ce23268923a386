"""A row's density is that of the normal distribution it says it is."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from diagnosis.normal import Normal, log_mass, of_sizes

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
