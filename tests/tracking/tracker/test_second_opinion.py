"""CSRT as a second opinion: asked only after a loss, for a few frames, and not believed without a likeness."""

import numpy as np
import pytest

from tests.tracking.tracker.pool import WATER, Pool, Thing, errors, still
from tracking.csrt import CropTracker, SecondOpinion
from tracking.sighting import Sighting

ROW = still((60, 60), (100, 60), (140, 60))
FADED = slice(10, 21)


def faded(share: float) -> Pool:
    """The middle one of three markers keeps only a share of its contrast in frames 10 to 20."""

    def contrast(frame: float) -> np.ndarray:
        return np.array([110.0, 110.0 * (share if 10 <= frame <= 20 else 1.0), 110.0])

    return Pool(ROW, (200, 120), contrast=contrast, texture=2.0)


def seen_by(sightings: list[Sighting], marker: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """(n,) seen at all, and (n,) by CSRT alone."""
    return np.array([s.seen[marker] for s in sightings]), np.array([s.by_csrt[marker] for s in sightings])


def test_a_marker_faded_to_a_quarter_is_seen_by_csrt_and_not_by_spots() -> None:
    pool = faded(0.25)
    without, _ = seen_by(pool.followed(25, use_csrt=False))
    sightings = pool.followed(25, use_csrt=True)
    seen, by_csrt = seen_by(sightings)
    assert not without[FADED].any()
    assert seen[10:14].all()
    assert np.array_equal(np.flatnonzero(by_csrt), [10, 11, 12, 13])
    assert np.nanmax(errors(sightings, pool.truths(25))) < 0.5
    assert all(s.confidence[1] <= 0.5 for s in sightings[10:14])


def test_csrt_that_jumps_onto_a_brighter_neighbour_is_refused() -> None:
    """20 px apart CSRT prefers the neighbour to the faded marker: then it says nothing."""

    def contrast(frame: float) -> np.ndarray:
        return np.array([110.0, 27.0 if frame >= 10 else 110.0, 110.0])

    pool = Pool(still((60, 60), (80, 60), (100, 60)), (180, 120), contrast=contrast, texture=1.0)
    sightings = pool.followed(16, use_csrt=True)
    assert np.nanmax(errors(sightings, pool.truths(16))) < 1.0


def test_csrt_is_asked_in_four_frames_of_a_loss_and_again_in_the_next_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = Pool(ROW, (200, 120), contrast=lambda f: np.array([110.0, 0.0 if 10 <= f <= 20 or f >= 25 else 110.0, 110]))
    tracker = pool.begun(use_csrt=True)[0]
    asked: list[int] = []
    step = CropTracker.step

    def counted(self: CropTracker, luma: np.ndarray) -> np.ndarray:
        asked[-1] += 1
        return step(self, luma)

    monkeypatch.setattr(CropTracker, "step", counted)
    for luma in pool.frames(36, 1):
        asked.append(0)
        tracker.step(luma)
    assert np.flatnonzero(asked).tolist() == [9, 10, 11, 12, 24, 25, 26, 27]
    assert max(asked) == 1


@pytest.mark.parametrize("luma", [WATER, 40.0, 210.0])
def test_an_answer_on_a_cover_is_refused(luma: float) -> None:
    """A cover as bright as the marker may have spots of its own, which count for about half."""
    cover = Thing(lambda _: np.array([100.0, 60.0]), (24.0, 40.0), luma, (10, 20))
    sightings = Pool(ROW, (200, 120), things=(cover,)).followed(25, use_csrt=True)
    seen, by_csrt = seen_by(sightings)
    assert not by_csrt[10:21].any()
    assert max(s.confidence[1] for s in sightings[FADED]) < 0.6
    assert seen[21:].all()


def test_an_answer_on_something_other_than_the_marker_is_refused() -> None:
    luma = Pool(still((60, 60)), (200, 120)).frame(0)
    opinion = SecondOpinion(threads=1)
    place = np.array([[60.0, 60.0]])
    opinion.remember(luma, place, np.array([True]))
    other = Pool(still(), (200, 120), things=(Thing(lambda _: np.array([60.0, 60.0]), (60.0, 8.0), 220.0),)).frame(0)
    assert opinion.ask(other, np.array([True]), np.array([14.0]), place) == {}


def test_two_markers_lost_at_once_never_get_one_answer() -> None:
    """Neighbours 16 px apart; one fades, the other is covered: CSRT of the second may drift onto the first."""

    def contrast(frame: float) -> np.ndarray:
        return np.array([110.0, 27.0 if frame >= 10 else 110.0, 0.0 if frame >= 10 else 110.0])

    pool = Pool(still((60, 60), (84, 60), (100, 60)), (180, 120), contrast=contrast, texture=1.0)
    for sighting in pool.followed(18, use_csrt=True):
        there = sighting.position_px[sighting.seen]
        apart = np.linalg.norm(there[:, None] - there, axis=2)[~np.eye(len(there), dtype=bool)]
        assert apart.min(initial=np.inf) > 7
