"""Boxes on the water are doubted, boxes on markers are not."""

import cv2
import numpy as np
import pytest

from swimcal.flags import Flag
from swimcal.tracks import as_tracks
from tests.tracking.tracker.pool import Pool, tail
from tracking.appearance import Appearance
from tracking.boxes import Box, StartBoxes
from tracking.find_boxes import doubtful_boxes, odd_one_out
from tracking.tracked import mask_untrusted, with_states

NAMES = tuple(f"tail_{k}" for k in range(9))
POOL = Pool(tail(), (480, 400))


def rippled(seed: int) -> tuple[Pool, np.ndarray]:
    """A pool whose water is a net of swells as wide as a marker, 12 steps of luma high, and its frame 0."""
    pool = POOL.but(seed=seed)
    rng = np.random.default_rng(seed)
    swell = sum(
        np.cos(np.add.outer(np.arange(400) * np.sin(a), np.arange(480) * np.cos(a)) * 2 * np.pi / length + shift)
        for a, length, shift in zip(
            rng.uniform(0, np.pi, 6), rng.uniform(22, 34, 6), rng.uniform(0, 2 * np.pi, 6), strict=True
        )
    )
    return pool, np.clip(pool.frame(0) + 12 / np.sqrt(3) * np.asarray(swell), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("contrast", [110.0, -80.0, 20.0])
def test_boxes_on_markers_are_not_flagged(contrast: float) -> None:
    pool = POOL.but(contrast=contrast)
    assert doubtful_boxes(pool.frame(0), pool.boxes(NAMES), NAMES) == ()


@pytest.mark.parametrize("seed", range(6))
def test_on_rippled_water_the_box_without_a_marker_is_flagged_and_no_other(seed: int) -> None:
    pool, luma = rippled(seed)
    boxes = dict(pool.boxes(NAMES, 0).boxes)
    boxes["tail_4"] = Box.around((150.0 + 20 * seed, 320.0), 18.0)
    flags = doubtful_boxes(luma, StartBoxes(7, boxes), NAMES)
    assert [(flag.kind, flag.markers, flag.frames) for flag in flags] == [("doubtful_box", ("tail_4",), (7, 7))]
    assert "is the box on its marker?" in flags[0].message


def test_a_marker_like_its_surroundings_and_much_else_is_hidden() -> None:
    rng = np.random.default_rng(5)
    luma = cv2.GaussianBlur(rng.integers(0, 256, (400, 480)).astype(np.float32), (0, 0), 6.0)
    luma = np.clip(128 + 12 * (luma - luma.mean()), 0, 255).astype(np.uint8)
    boxes = {name: Box.around((60.0 + 42 * k, 200.0), 18.0) for k, name in enumerate(NAMES)}
    luma[192:209, 52:69] = 255  # one marker brighter than all
    flags = doubtful_boxes(luma, StartBoxes(0, boxes), NAMES)
    hidden = [flag.markers[0] for flag in flags if flag.kind == "indistinct"]
    assert NAMES[0] not in hidden
    assert len(hidden) >= 2


def test_an_indistinct_marker_counts_in_no_frame() -> None:
    tracks = as_tracks(NAMES, np.arange(20) / 60, np.zeros((20, 9, 2)), np.ones((20, 9)))
    tracked = with_states(tracks, np.ones((20, 9), np.int8), np.ones((20, 9)), [Flag("indistinct", ("tail_3",), None)])
    counts = mask_untrusted(tracked).confidence.values > 0
    assert not counts[:, 3].any()
    assert np.delete(counts, 3, axis=1).all()


def test_the_look_of_one_marker_is_odd_if_it_is_fainter_and_of_the_other_kind() -> None:
    def odd(*contrast: float) -> int | None:
        shown = np.array(contrast)
        return odd_one_out(Appearance(np.sign(shown), np.full(len(shown), 12.0), np.abs(shown), np.ones(len(shown))))

    assert odd(-170.0, -176.0, 80.0, -175.0) == 2
    assert odd(-170.0, -176.0, 160.0, -175.0) is None  # a white dot among black ones
    assert odd(-170.0, -176.0, 80.0, 90.0, -175.0) is None
    assert odd(-170.0, 80.0) is None


def test_in_a_picture_full_of_boxes_nothing_is_reported() -> None:
    pool = POOL.but(size=(180, 60), path=tail(at=(10.0, 30.0)))
    assert doubtful_boxes(pool.frame(0), pool.boxes(NAMES), NAMES) == ()


@pytest.mark.parametrize("width", [2, 3])
@pytest.mark.parametrize("light", [(40, 230), (210, 30)])
def test_rings_are_doubted_and_dots_are_not(width: int, light: tuple[int, int]) -> None:
    random = np.random.default_rng(width)
    (water, ring), places = light, 40 + 45 * np.arange(9) + random.uniform(-2, 2, 9)
    for filled in (False, True):
        luma = np.full((120, 480), water, np.uint8)
        for place in places:
            cv2.circle(luma, (round(16 * place), 16 * 60), 16 * 7, ring, -1 if filled else width, cv2.LINE_AA, 4)
        luma = cv2.GaussianBlur(np.clip(luma + random.normal(0, 3, luma.shape), 0, 255).astype(np.uint8), (0, 0), 0.7)
        boxes = {name: Box.around((place + 1.0, 59.0), 20.0) for name, place in zip(NAMES, places, strict=True)}
        flags = doubtful_boxes(luma, StartBoxes(0, boxes), NAMES)
        rings = [flag for flag in flags if "look like rings" in flag.message]
        assert [(flag.kind, flag.markers, flag.frames) for flag in rings] == (
            [] if filled else [("doubtful_box", NAMES, None)]
        )
