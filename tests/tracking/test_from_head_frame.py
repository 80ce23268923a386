"""Back from the head frame: the pool again, but for where its origin lies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracking.test_normaliser import NECK, NOSE, moved, swim
from tracking import from_head_frame, to_head_frame


@given(turn=st.floats(-np.pi, np.pi), x=st.floats(-5, 5), y=st.floats(-5, 5), seed=st.integers(0, 20))
def test_it_inverts_the_normaliser_up_to_a_shift(turn: float, x: float, y: float, seed: int) -> None:
    position = moved(swim(60, seed), turn, np.array([x, y]))
    back = from_head_frame(to_head_frame(position, NOSE, NECK))

    np.testing.assert_allclose(back, position - position[0, NOSE], atol=1e-11)


def test_the_mean_of_the_head_cannot_be_led_back_and_says_so() -> None:
    with pytest.raises(ValueError, match="displacement: found 'head_mean', expected 'nose'"):
        from_head_frame(to_head_frame(swim(), NOSE, NECK, "head_mean"))
