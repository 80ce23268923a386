"""Names that hold where the nearest dot is not the right one: full beats from the first frame on, and shaken rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tracking.fast_starts import FastStart, draw_clips, follow_clips
from tests.cases import later
from tests.tracking.tracker.pool import Pool
from tracking.identities import Prediction, Spacing, assemble_markers
from tracking.spots import Spots


@pytest.mark.parametrize(("seed", "count", "frames"), [(1, 10, 4), *later((4, 200, 60))])
def test_no_dot_gets_another_name_in_clips_that_begin_in_full_beat(seed: int, count: int, frames: int) -> None:
    clips = draw_clips(seed, count)[1::2]  # the hard ones
    found, nearest = follow_clips(clips, frames), follow_clips(clips, frames, joined=False)

    assert found.identity <= 0.001
    assert found.lost <= 0.005
    assert found.rms_px < 0.15
    assert nearest.lost > found.lost  # or the clips are no test: the student's tracker, each dot for itself


def shaken(hz: float, share: float, along: float) -> Pool:
    """A row of seven dots at rest, shaken for a second at 20 frames/s by a share of their distance, and at rest."""
    spacing, row = 40.0, np.arange(7)[:, None] * [40.0, 0.0] + [110.0, 110.0]
    way = share * spacing * np.array([np.cos(along), np.sin(along)])

    def path(frame: float) -> np.ndarray:
        beat = np.clip((frame - 5) / 20, 0, 1)
        return row + way * np.sin(np.pi * beat) ** 0.5 * np.sin(2 * np.pi * hz * beat)

    return Pool(path, (460, 220), diameter=12.0, exposure=0.1)


@pytest.mark.parametrize("hz", [3.0, *later(5.0), 6.0])
@pytest.mark.parametrize("along", [0.0, *later(np.pi / 2), 0.7])
def test_a_shaken_row_keeps_its_names(hz: float, along: float) -> None:
    pool = shaken(hz, 0.45, along)
    away = np.array([np.linalg.norm(s.position_px - pool.truth(k), axis=1) for k, s in enumerate(pool.followed(32))])

    assert away[26:].max() < 0.5  # at rest
    assert away.max() < 6


def test_a_clip_is_the_same_turned_or_mirrored() -> None:
    clip = draw_clips(5, 2)[1]
    turned = replace(clip, heading_rad=clip.heading_rad + 1.1)
    mirrored = replace(clip, heading_rad=-clip.heading_rad, swing_rad=-clip.swing_rad)

    for each in (clip, turned, mirrored):
        assert isinstance(each, FastStart)
        assert follow_clips([each], 8).identity == 0


def row_of(*places: float) -> np.ndarray:
    return np.array([[place, 0.0] for place in places])


def test_of_two_names_that_want_one_dot_each_gets_one_where_the_distances_hold() -> None:
    was, now = row_of(0, 10, 20, 30), row_of(8, 18, 28, 38)  # the nearest dots are one too far
    predicted = Prediction(was, np.full(4, 12.5), np.zeros((4, 2)))
    order = np.array([2, 0, 3, 1])
    spots = Spots(now[order], np.ones(4))

    found = assemble_markers(spots, predicted, np.full(4, 7.5), Spacing.begin(was), whole=True)
    assert found.chosen[order].tolist() != order.tolist()
    assert now[order][found.chosen].tolist() == now.tolist()
    assert found.cost < 1


def test_a_dot_that_is_hidden_leaves_its_marker_without_one_and_the_others_as_they_are() -> None:
    was = row_of(0, 10, 20, 30)
    spots = Spots(row_of(0, 10, 30), np.ones(3))

    found = assemble_markers(
        spots, Prediction(was, np.full(4, 12.5), np.zeros((4, 2))), np.full(4, 7.5), Spacing.begin(was), False
    )
    assert found.chosen.tolist() == [0, 1, -1, 2]


@pytest.mark.parametrize("seed", range(4))
def test_a_row_thrown_by_two_thirds_of_its_distance_among_faint_spots_keeps_its_names(seed: int) -> None:
    """As a frame of a real row that is shaken: all but the last name fit the dots one too far."""
    random = np.random.default_rng(seed)
    was = np.arange(7)[:, None] * [40.0, 0.0] + [100.0, 60.0]
    thrown = was - [0.67 * 40.0, 0.0]
    litter = random.uniform([40, 30], [400, 90], (30, 2))
    litter = litter[np.linalg.norm(litter[:, None] - thrown, axis=2).min(axis=1) > 4]
    strength = np.concatenate([random.uniform(0.8, 1.2, 7), random.uniform(0.3, 0.6, len(litter))])
    spots = Spots(np.concatenate([thrown, litter]), strength)
    predicted = Prediction(was + np.array([0.14 * 40.0, 0.0]), np.full(7, 65.0), np.zeros((7, 2)))

    found = assemble_markers(spots, predicted, np.full(7, 26.0), Spacing.begin(was), whole=True)
    assert found.chosen.tolist() == list(range(7))
