"""A video that stands still must not pass for a robot at rest, nor the other way round."""

import numpy as np

from tracking.quality import frozen_flags, frozen_picture


def moving(frames: int = 60) -> np.ndarray:
    """(n, 3, 2) three markers that drift by 4 px a frame, px."""
    return np.arange(frames)[:, None, None] * 4.0 + np.arange(3)[None, :, None] * 50.0 + np.zeros(2)


def test_a_picture_that_freezes_is_left_out_but_for_its_first_frame() -> None:
    position = moving()
    position[20:30] = position[20]
    frozen = frozen_picture(position)
    assert list(np.flatnonzero(frozen)) == list(range(21, 30))
    (flag,) = frozen_flags(frozen, ("a", "b", "c"))
    assert (flag.kind, flag.frames, flag.markers) == ("frozen_marker", (21, 29), ("a", "b", "c"))
    assert "no marker moves for 9 frames" in flag.message


def test_a_duplicated_frame_or_two_is_let_pass() -> None:
    position = moving()
    position[20:23] = position[20]
    assert not frozen_picture(position).any()


def test_a_robot_that_slows_to_a_rest_is_not_frozen() -> None:
    position = 100 * np.exp(-np.arange(80) / 5.0)[:, None, None] + np.zeros((80, 3, 2))
    assert not frozen_picture(np.round(2 * position) / 2).any()
