from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from session import load_session
from swimmer import load_robot
from synthetic import make_session
from synthetic.faults import Freeze, Gap, Jump, Merge, TrackFault, with_faults
from tests.synthetic.plans import small_plan, tracks_of
from tracking import check_tracks

MARKERS = ("a", "b", "c")
FIRST, FRAMES = 4, 3
SPAN = slice(FIRST, FIRST + FRAMES)
FAULTS: tuple[TrackFault, ...] = (
    Merge(marker="b", onto="c", first=FIRST, frames=FRAMES, offset_px=(2.0, 0.5)),
    Freeze(marker="b", first=FIRST, frames=FRAMES),
    Jump(marker="b", first=FIRST, frames=FRAMES, offset_px=(-9.0, 12.0)),
    Gap(marker="b", first=FIRST, frames=FRAMES),
)


@pytest.fixture
def position() -> np.ndarray:
    return np.random.default_rng(5).uniform(0, 100, (12, 3, 2))


def faulty(position: np.ndarray, fault: TrackFault) -> np.ndarray:
    """The stretch of the faulty marker."""
    return with_faults(position, MARKERS, [fault])[SPAN, 1]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.kind)
def test_a_fault_changes_its_marker_in_its_frames_only(fault: TrackFault, position: np.ndarray) -> None:
    before = position.copy()
    result = with_faults(position, MARKERS, [fault])

    np.testing.assert_array_equal(position, before)
    result[SPAN, 1] = before[SPAN, 1]
    np.testing.assert_array_equal(result, before)


def test_a_merged_box_keeps_its_distance_from_the_other_box(position: np.ndarray) -> None:
    np.testing.assert_allclose(faulty(position, FAULTS[0]) - position[SPAN, 2], [[2.0, 0.5]] * FRAMES)


def test_a_frozen_box_stays_where_it_was(position: np.ndarray) -> None:
    np.testing.assert_array_equal(faulty(position, FAULTS[1]), [position[FIRST, 1]] * FRAMES)


def test_a_box_jumps_by_its_offset(position: np.ndarray) -> None:
    np.testing.assert_allclose(faulty(position, FAULTS[2]) - position[SPAN, 1], [[-9.0, 12.0]] * FRAMES)


def test_nothing_is_seen_in_a_gap(position: np.ndarray) -> None:
    assert np.isnan(faulty(position, FAULTS[3])).all()


def test_a_marker_cannot_merge_onto_itself() -> None:
    with pytest.raises(ValidationError, match="b cannot merge onto itself; name another marker in `onto`"):
        Merge(marker="b", onto="b", first=0, frames=1)


@pytest.mark.parametrize(
    "fault",
    [
        Merge(marker="tail_4", onto="tail_5", first=90, frames=30),
        Freeze(marker="tail_5", first=90, frames=40),
        Jump(marker="tail_2", first=90, frames=4, offset_px=(20.0, -15.0)),
        Gap(marker="tail_3", first=90, frames=10),
    ],
    ids=lambda fault: fault.kind,
)
def test_track_quality_flags_the_fault_under_its_kind_and_where_it_is(fault: TrackFault, tmp_path: Path) -> None:
    session = load_session(make_session(tmp_path / "s", small_plan(slow={"faults": (fault,)})))
    quality = check_tracks(tracks_of(session, "slow"), load_robot())
    weight = quality.weight[:, session.markers.index(fault.marker)]

    found = [flag for flag in quality.flags if flag.kind == fault.kind and fault.marker in flag.markers]
    assert len(found) == 1
    assert found[0].frames is not None
    assert abs(found[0].frames[0] - fault.first) <= 5
    assert abs(found[0].frames[1] - fault.last) <= 2
    assert (weight[fault.span] == 0).mean() >= 0.8
    assert (quality.weight == 0).sum() <= 1.2 * fault.frames
