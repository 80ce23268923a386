"""Hues tell markers apart in light and shade, and tell nothing of gray, glints and like colours."""

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tracking.colours import MarkerColours, chroma_at
from tracking.follow_video import Partial
from tracking.tracker import MarkerTracker

PLACES = np.arange(5)[:, None] * [30.0, 0.0] + [20.0, 15.0]
DIAMETER_PX = np.full(5, 12.0)
hues = st.floats(-np.pi, np.pi)


def painted(hue_rad: np.ndarray, chroma: np.ndarray) -> np.ndarray:
    """(h, w, 3) uint8: a square patch of each colour at each place, gray around it."""
    yuv = np.full((30, 160, 3), 128, np.uint8)
    for (x, y), angle, strength in zip(PLACES.astype(int), hue_rad, chroma, strict=True):
        yuv[y - 6 : y + 7, x - 6 : x + 7, 1:] = 128 + np.rint(strength * np.array([np.cos(angle), np.sin(angle)]))
    return yuv


def told(hue_rad: np.ndarray) -> MarkerColours | None:
    return MarkerColours.of_markers(painted(hue_rad, np.full(5, 60.0)), PLACES, DIAMETER_PX)


@given(hues, st.lists(st.floats(0.3, 1.0), min_size=5, max_size=5))
def test_of_two_opposite_hues_each_is_the_others_in_any_shade(hue: float, shade: list[float]) -> None:
    hue_rad = hue + np.pi * (np.arange(5) % 2)
    colours = told(hue_rad)
    assert colours is not None

    found = colours.mismatch(chroma_at(painted(hue_rad, 60 * np.array(shade)), PLACES, DIAMETER_PX[:1]))
    other = (np.arange(5)[:, None] - np.arange(5)) % 2 == 1
    assert np.array_equal(found, other)


@given(hues, st.lists(st.floats(-0.3, 0.3), min_size=5, max_size=5))
def test_like_hues_are_not_told_apart(hue: float, off: list[float]) -> None:
    assert told(hue + np.array(off)) is None


@given(hues, st.integers(0, 4))
def test_a_glint_is_nobodys_and_a_marker_that_began_under_one_is_like_all(hue: float, which: int) -> None:
    hue_rad = hue + np.pi * (np.arange(5) % 2)
    under_glint = np.where(np.arange(5) == which, 3.0, 60.0)
    colours, begun_under = (
        MarkerColours.of_markers(painted(hue_rad, chroma), PLACES, DIAMETER_PX)
        for chroma in (np.full(5, 60.0), under_glint)
    )
    assert colours is not None
    assert begun_under is not None

    assert not colours.mismatch(chroma_at(painted(hue_rad, under_glint), PLACES, DIAMETER_PX[:1]))[:, which].any()
    assert not begun_under.mismatch(chroma_at(painted(hue_rad, np.full(5, 60.0)), PLACES, DIAMETER_PX[:1]))[which].any()


def test_places_beyond_the_picture_take_the_colour_at_its_rim() -> None:
    colours = told(np.array([0.0, np.pi, 0, np.pi, 0]))
    assert colours is not None
    beyond = np.array([[-40.0, -40.0], [400.0, 10.0]])
    assert colours.mismatch(chroma_at(painted(np.zeros(5), np.full(5, 60.0)), beyond, DIAMETER_PX[:1])).shape == (5, 2)


@given(hues)
def test_among_markers_of_their_own_hues_a_gray_one_is_on_none_of_theirs(hue: float) -> None:
    hue_rad, chroma = hue + 2 * np.pi / 4 * np.arange(5), np.array([60.0, 60, 60, 60, 2])
    colours = MarkerColours.of_markers(painted(hue_rad, chroma), PLACES, DIAMETER_PX)
    assert colours is not None

    own = colours.mismatch(chroma_at(painted(hue_rad, chroma), PLACES, DIAMETER_PX[:1]))
    assert np.array_equal(own[4], [1, 1, 1, 1, 0])
    assert not own.diagonal().any()


def test_interrupted_work_goes_on_with_the_colours_it_began_with(tmp_path: Path) -> None:
    yuv = painted(np.pi * (np.arange(5) % 2), np.full(5, 60.0))
    luma = np.where(yuv[..., 1] == 128, 60, 200).astype(np.uint8)
    tracker, _ = MarkerTracker.begin(luma, PLACES, DIAMETER_PX, yuv=yuv)
    assert tracker.colours is not None

    Partial(tmp_path / "kept.npz", "same").write(tracker.state())
    kept = Partial(tmp_path / "kept.npz", "same").read()
    assert kept is not None
    again = MarkerTracker.restored(kept).colours
    assert again is not None
    assert np.array_equal(again.chroma, tracker.colours.chroma)
