"""The joint assignment: one spot a marker, and one marker a spot."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tracking.identities import Prediction
from tracking.sighting import assign
from tracking.spots import Spots

seeds = st.integers(0, 2**32 - 1)


def scene(seed: int) -> tuple[Spots, Prediction]:
    """Spots and markers crowded at random; there may be none."""
    rng = np.random.default_rng(seed)
    markers, spots = rng.integers(1, 12), rng.integers(0, 16)
    place = rng.uniform(0, 80, (markers, 2))
    predicted = Prediction(place, rng.uniform(3, 60, markers), np.zeros_like(place))
    return Spots(rng.uniform(0, 80, (spots, 2)), rng.uniform(0.3, 1.2, spots)), predicted


@given(seeds)
def test_no_two_markers_share_a_spot_and_none_is_beyond_its_gate(seed: int) -> None:
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
