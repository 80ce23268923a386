"""Faint markers are followed by CSRT over many times the width of its crop."""

from collections.abc import Iterator

import numpy as np
import pytest

from tracking.csrt import CROP, Crop, FaintMarkers

DIAMETER_PX, CONTRAST, NOISE = 15.0, 25.0, 3.0
HEIGHT, WIDTH, FRAMES = 260, 900, 100
BOX_PX = np.array([DIAMETER_PX + 6, DIAMETER_PX + 6])


def places(frame: int) -> np.ndarray:
    """(2, 2) where the two are: they sweep to and fro across the picture's height and along all of it."""
    sweep = 40 * np.sin(2 * np.pi * frame / 48)
    return np.array([[100 + 6.7 * frame, 130 + sweep], [140 + 6.7 * frame, 130 - sweep]])


def frames() -> Iterator[np.ndarray]:
    random = np.random.default_rng(1)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    for frame in range(FRAMES):
        picture = 90 + random.normal(0, NOISE, (HEIGHT, WIDTH))
        for x, y in places(frame):
            inside = np.clip(DIAMETER_PX / 2 + 0.5 - np.hypot(columns - x, rows - y), 0, 1)
            picture += CONTRAST * inside
        yield np.clip(picture, 0, 255).astype(np.uint8)


def followed() -> np.ndarray:
    """(n, 2, 2) where the markers are seen."""
    shown = frames()
    first = next(shown)
    faint = FaintMarkers(np.array([True, True]), [Crop.around(first, place) for place in places(0)], BOX_PX, threads=1)
    seen = [faint.step(luma) for luma in shown]
    return np.array([[place[0], place[1]] for place in seen])


@pytest.mark.long
def test_a_marker_is_followed_far_beyond_its_first_crop() -> None:
    seen = followed()
    truth = np.array([places(frame) for frame in range(1, FRAMES)])

    assert np.ptp(truth[:, 0, 0]) > 8 * CROP
    assert np.linalg.norm(seen - truth, axis=2).max() < 0.3 * DIAMETER_PX
