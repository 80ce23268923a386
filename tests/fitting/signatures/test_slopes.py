"""What an effect does at strengths that were not tried is right where its course can be known from those that were."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from fitting.signatures import Signature, Whitened, little, pieces, row_slopes
from tests.fitting.signatures.made import Made

TURN, BEND = np.random.default_rng(3).standard_normal((2, 20))
Does = Callable[[float], np.ndarray]


def signature(does: Does, low: float = -5.0, high: float = 5.0, diverges: Sequence[float] = ()) -> Signature:
    tried = np.array([s for s in (-3.0, -1.0, 1.0, 3.0) if low <= s <= high])
    rows = np.array([np.full(20, np.nan) if s in diverges else does(s) for s in tried])
    return Signature(Made("made", (low, high)), tried[:, None], rows, np.zeros((len(tried), 0)))


def done(found: Signature, strength: float) -> np.ndarray:
    """By the slope of the piece in which a strength lies."""
    own = [piece for piece in pieces(found, 0) if piece.low <= strength <= piece.high]
    return strength * own[0].slope


def linear(strength: float) -> np.ndarray:
    return strength * TURN


def bent(strength: float) -> np.ndarray:
    return strength * TURN + strength**2 * BEND


def kinked(strength: float) -> np.ndarray:
    return strength * (TURN if strength > 0 else BEND)


@pytest.mark.parametrize("does", [linear, bent, kinked])
@pytest.mark.parametrize("strength", [-3.0, -1.0, -0.3, 0.3, 1.0, 3.0])
def test_little_and_tried_strengths_do_what_they_do(does: Does, strength: float) -> None:
    assert done(signature(does), strength) == pytest.approx(does(strength))


@pytest.mark.parametrize("strength", [0.3, 1.0, 3.0])
def test_of_one_sign_little_strengths_follow_from_strong_ones(strength: float) -> None:
    assert done(signature(bent, low=0.0), strength) == pytest.approx(bent(strength))


@pytest.mark.parametrize(("low", "high"), [(-5.0, 5.0), (0.0, 5.0), (-1.5, 5.0), (-5.0, 0.0)])
def test_pieces_share_out_all_that_bounds_allow(low: float, high: float) -> None:
    found = pieces(signature(bent, low, high), 0)
    assert (found[0].low, found[-1].high) == (low, high)
    assert [each.high for each in found[:-1]] == [each.low for each in found[1:]]
    assert all(each.low < each.high for each in found)


def test_little_is_the_mean_of_both_sides() -> None:
    found = little(signature(bent), 0)
    assert found == pytest.approx(TURN)
    assert little(signature(linear, diverges=(-3.0, -1.0, 3.0)), 0) == pytest.approx(TURN)
    assert little(signature(linear, diverges=(-3.0, -1.0, 1.0, 3.0)), 0) is None


class _DivergesBeside:
    """Features that are the coefficients' sum and product; the second trial's twin diverges beside on some sides."""

    beside = 1

    def __init__(self, sides: tuple[int, ...]) -> None:
        self._sides = sides

    def simulated(self, points: np.ndarray) -> np.ndarray:
        features = np.column_stack([points.sum(axis=1), points.prod(axis=1)])
        gone = [np.sign(round(point[0] - BESIDE[0], 9)) in self._sides for point in points]
        features[gone, 1] = np.nan
        return features


BESIDE = np.array([0.5, 2.0, 3.0, 1.5, 1.0])


@pytest.mark.parametrize(("sides", "slope"), [((), 9.0), ((1,), 9.0), ((-1,), 9.0), ((1, -1), 0.0)])
def test_a_twin_that_diverges_beside_the_coefficients_leaves_the_other_side(
    sides: tuple[int, ...], slope: float
) -> None:
    slopes = row_slopes(_DivergesBeside(sides), BESIDE)  # type: ignore[arg-type]
    np.testing.assert_allclose(slopes[0], 1.0)
    assert slopes[1, 0] == pytest.approx(slope, rel=0.05)
    np.testing.assert_allclose(slopes[1, 1:], BESIDE.prod() / BESIDE[1:], rtol=1e-3)
    assert not slopes[2].any()


def test_what_coefficients_and_noise_can_do_has_little_length() -> None:
    """Of nine numbers with unit noise, of which coefficients move the first five and have no prior to speak of."""
    unit, row = np.eye(9), np.arange(1.0, 10.0)
    space, held = (Whitened.of(unit, unit[:, :5], np.full(5, prior_sd)) for prior_sd in (1e9, 1.0))
    assert space.length(np.where(np.arange(9) < 5, row, 0.0)) == pytest.approx(0.0, abs=1e-6)
    assert space.length(row) == pytest.approx(np.linalg.norm(row[5:]))
    assert held.length(unit[0]) == pytest.approx(np.sqrt(0.5))

    along = np.ones(9) / 3
    correlated = Whitened.of(unit + 8 * np.outer(along, along), np.zeros((9, 5)), np.ones(5))
    assert correlated.length(6 * along) == pytest.approx(2.0)
