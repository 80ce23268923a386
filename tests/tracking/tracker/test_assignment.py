"""The joint assignment: one spot a marker, and one marker a spot."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tracking.tracker.prediction import Prediction
from tracking.tracker.spots import Spots
from tracking.tracker.tracker import assign

seeds = st.integers(0, 2**32 - 1)


def scene(seed: int) -> tuple[Spots, Prediction]:
    """Spots and markers crowded at random; there may be none."""
    rng = np.random.default_rng(seed)
    markers, spots = rng.integers(1, 12), rng.integers(0, 16)
    predicted = Prediction(rng.uniform(0, 80, (markers, 2)), rng.uniform(3, 60, markers))
    return Spots(rng.uniform(0, 80, (spots, 2)), rng.uniform(0.3, 1.2, spots)), predicted


@given(seeds)
def test_no_two_markers_share_a_spot_and_none_lies_beyond_its_gate(seed: int) -> None:
    spots, predicted = scene(seed)
    chosen = assign(spots, predicted)
    taken = chosen[chosen >= 0]
    assert chosen.shape == predicted.gate_px.shape
    assert len(set(taken.tolist())) == len(taken)
    away = np.linalg.norm(spots.position_px[taken] - predicted.position_px[chosen >= 0], axis=1)
    assert (away <= predicted.gate_px[chosen >= 0]).all()


@given(seeds)
def test_a_marker_goes_without_only_when_every_spot_in_its_gate_is_taken(seed: int) -> None:
    spots, predicted = scene(seed)
    chosen = assign(spots, predicted)
    free = np.setdiff1d(np.arange(len(spots.strength)), chosen)
    for marker in np.flatnonzero(chosen < 0):
        away = np.linalg.norm(spots.position_px[free] - predicted.position_px[marker], axis=1)
        assert (away > predicted.gate_px[marker]).all()


def chain(markers: int = 9, spacing: float = 18.0) -> np.ndarray:
    return np.column_stack([spacing * np.arange(markers), np.zeros(markers)]) + 50.0


@given(seeds, st.integers(0, 8))
def test_a_missing_spot_leaves_one_marker_out_and_not_its_neighbours(seed: int, missing: int) -> None:
    """Even though the gates of neighbours 18 px apart overlap."""
    rng = np.random.default_rng(seed)
    place = chain()
    spots = np.delete(place + rng.uniform(-2.5, 2.5, place.shape), missing, axis=0)
    chosen = assign(Spots(spots, np.ones(8)), Prediction(place, np.full(9, 14.0)))
    expected = np.delete(np.arange(9), missing)
    assert chosen[missing] == -1
    assert np.array_equal(chosen[expected], np.arange(8))


@given(seeds)
def test_a_common_shift_of_a_chain_does_not_move_the_names_along(seed: int) -> None:
    """All markers are off by up to 40 % of the spacing in one direction."""
    rng = np.random.default_rng(seed)
    place, angle = chain(), rng.uniform(0, 2 * np.pi)
    shift = rng.uniform(0, 7.2) * np.array([np.cos(angle), np.sin(angle)])
    chosen = assign(Spots(place + shift, np.ones(9)), Prediction(place, np.full(9, 20.0)))
    assert np.array_equal(chosen, np.arange(9))
