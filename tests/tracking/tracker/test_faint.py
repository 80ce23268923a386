"""Faint markers are followed by CSRT over many times the width of its crop, and taken up again to the same bits."""

from collections.abc import Iterator

import numpy as np
import pytest

from tracking.tracker.csrt import CROP, Crop
from tracking.tracker.faint import FaintMarkers

DIAMETER_PX, CONTRAST, NOISE = 15.0, 25.0, 3.0
HEIGHT, WIDTH, FRAMES = 260, 900, 100
BOX_PX = np.array([DIAMETER_PX + 6, DIAMETER_PX + 6])


def places(frame: int) -> np.ndarray:
    """(2, 2) where the two are: they sweep to and fro across the picture's height and along all of it."""
    sweep = 40 * np.sin(2 * np.pi * frame / 48)
    return np.array([[100 + 6.7 * frame, 130 + sweep], [140 + 6.7 * frame, 130 - sweep]])


def frames(count: int = FRAMES) -> Iterator[np.ndarray]:
    random = np.random.default_rng(1)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    for frame in range(count):
        picture = 90 + random.normal(0, NOISE, (HEIGHT, WIDTH))
        for x, y in places(frame):
            inside = np.clip(DIAMETER_PX / 2 + 0.5 - np.hypot(columns - x, rows - y), 0, 1)
            picture += CONTRAST * inside
        yield np.clip(picture, 0, 255).astype(np.uint8)


def followed(count: int = FRAMES) -> tuple[FaintMarkers, np.ndarray]:
    """The markers after so many frames, and (n, 2, 2) where they were seen."""
    shown = frames(count)
    first = next(shown)
    faint = FaintMarkers(np.array([True, True]), [Crop.around(first, place) for place in places(0)], BOX_PX, threads=1)
    seen = [faint.step(luma) for luma in shown]
    return faint, np.array([[place[0], place[1]] for place in seen])


def test_a_marker_is_followed_far_beyond_its_first_crop() -> None:
    _, seen = followed()
    truth = np.array([places(frame) for frame in range(1, FRAMES)])

    assert np.ptp(truth[:, 0, 0]) > 8 * CROP
    assert np.linalg.norm(seen - truth, axis=2).max() < 0.3 * DIAMETER_PX


@pytest.mark.long
def test_taken_up_again_it_goes_on_to_the_same_bits() -> None:
    shown = list(frames(60))
    faint, seen = followed(40)
    again = FaintMarkers.restored(faint.state(), threads=1)

    assert again.behind == 39
    assert again.replay(shown[1:40])
    for luma in shown[40:]:
        one, other = faint.step(luma), again.step(luma)
        np.testing.assert_array_equal(np.array(list(one.values())), np.array(list(other.values())))
    assert len(seen) == 39


def test_with_frames_missing_it_cannot_be_taken_up() -> None:
    faint, _ = followed(10)
    assert not FaintMarkers.restored(faint.state()).replay(list(frames(5))[1:])
