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


@given(seed=st.integers(0, 1000))
def test_it_inverts_any_motion_not_only_that_of_a_fish(seed: int) -> None:
    position = np.random.default_rng(seed).normal(size=(30, 4, 2))
    back = from_head_frame(to_head_frame(position, NOSE, NECK))

    np.testing.assert_allclose(back, position - position[0, NOSE], atol=1e-10)


def test_the_normaliser_inverts_it() -> None:
    head = to_head_frame(swim(), NOSE, NECK)
    again = to_head_frame(from_head_frame(head), NOSE, NECK)

    for name in ("position_m", "shape_m", "path_m", "heading_rad"):
        np.testing.assert_allclose(getattr(again, name), getattr(head, name), atol=1e-12)


def test_many_trajectories_at_once_are_as_one_after_another() -> None:
    positions = np.stack([swim(seed=seed) for seed in range(3)])
    together = from_head_frame(to_head_frame(positions, NOSE, NECK))

    for one, position in zip(together, positions, strict=True):
        np.testing.assert_allclose(one, from_head_frame(to_head_frame(position, NOSE, NECK)), atol=1e-12)


def test_the_mean_of_the_head_cannot_be_led_back_and_says_so() -> None:
    with pytest.raises(ValueError, match="displacement: found 'head_mean', expected 'nose'"):
        from_head_frame(to_head_frame(swim(), NOSE, NECK, "head_mean"))
