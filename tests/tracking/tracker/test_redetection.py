"""A robot whose markers differ in hue is found again anywhere, at any heading, or not at all."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tracking.tracker.test_real_dots import BLUE, DARK, GREEN, RED, YELLOW, Clip
from tracking.appearance import measure_appearance
from tracking.colours import MarkerColours, redetect

PAINTS = np.array([GREEN, RED, BLUE, YELLOW, (200, 60, 200)], float)
ROW = np.arange(5)[:, None] * [34.0, 0.0]
PAIRS, APART_PX = np.column_stack([np.arange(4), np.arange(1, 5)]), np.full(4, 34.0)


def picture(*bodies: np.ndarray, paints: np.ndarray = PAINTS) -> tuple[np.ndarray, np.ndarray]:
    """Grey (h, w), in which all paints are bright, and (h, w, 3) colours."""
    rgb, grey = np.full((400, 500, 3), DARK, np.uint8), np.full((400, 500), 30, np.uint8)
    for places in bodies:
        for place, paint in zip(np.rint(16 * places).astype(int).tolist(), paints.tolist(), strict=True):
            cv2.circle(rgb, place, 16 * 6, paint, -1, cv2.LINE_AA, 4)
            cv2.circle(grey, place, 16 * 6, 200, -1, cv2.LINE_AA, 4)
    return grey, cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV)


def turned(angle: float, at: tuple[float, float]) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return (ROW - ROW.mean(axis=0)) @ np.array([[cos, sin], [-sin, cos]]) + at


def sought(*bodies: np.ndarray, paints: np.ndarray = PAINTS) -> np.ndarray | None:
    """(5, 2) px, found after a start at (120, 90)."""
    start = turned(0.0, (120.0, 90.0))
    grey, yuv = picture(start, paints=paints)
    look = measure_appearance(grey, start, np.full(5, 15.0))
    colours = MarkerColours.of_markers(yuv, start, look.diameter_px)
    assert colours is not None
    return redetect(*picture(*bodies, paints=paints), colours, look, PAIRS, APART_PX)


@pytest.mark.parametrize("seed", range(8))
def test_wherever_it_is_and_heads_each_marker_gets_its_own_dot(seed: int) -> None:
    random = np.random.default_rng(seed)
    there = turned(random.uniform(-np.pi, np.pi), tuple(random.uniform([100, 100], [400, 300]))) + random.normal(
        0, 1, (5, 2)
    )

    found = sought(there)
    assert found is not None
    assert np.linalg.norm(found - there, axis=1).max() < 2


def test_of_two_that_look_the_same_none_is_taken() -> None:
    assert sought(turned(0.4, (130.0, 120.0)), turned(-2.0, (360.0, 280.0))) is None


def test_where_the_row_reads_the_same_from_both_ends_none_is_taken() -> None:
    assert sought(turned(0.4, (230.0, 180.0)), paints=PAINTS[[0, 1, 2, 1, 0]]) is None


def test_with_a_marker_out_of_sight_none_is_taken() -> None:
    assert sought(turned(0.0, (440.0, 200.0))) is None


def test_a_robot_that_is_taken_out_and_put_back_turned_round_is_followed_again(tmp_path: Path) -> None:
    class PutBack(Clip):
        def places(self, frame: int) -> np.ndarray:
            at = super().places(frame)
            if frame < 20:
                return at
            return at - [800.0, 0.0] if frame < 45 else np.array([420.0, 300.0]) - at

    clip = PutBack(dots=tuple(map(tuple, PAINTS.tolist())), off_px=0.0)
    off = clip.off(tmp_path, frames=80, find=lambda _: None)

    assert np.nanmax(off[60:]) < 2
    assert np.isfinite(off[75:]).all()
