from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from swimcal.robot import load_robot
from swimcal.session import load_session
from swimsynth.plan import Merge
from swimsynth.session import make_session
from tests.swimsynth.plans import small_plan, tracks_of
from tracking.quality import check_tracks


def test_a_merged_box_keeps_its_distance_from_the_other_box_in_its_frames_only() -> None:
    before = np.random.default_rng(5).uniform(0, 100, (12, 3, 2))
    found = before.copy()
    Merge(marker="b", onto="c", first=4, frames=3, offset_px=(2.0, 0.5)).apply(found, ("a", "b", "c"))

    np.testing.assert_allclose(found[4:7, 1] - before[4:7, 2], [[2.0, 0.5]] * 3)
    found[4:7, 1] = before[4:7, 1]
    np.testing.assert_array_equal(found, before)


def test_a_marker_cannot_merge_onto_itself() -> None:
    with pytest.raises(ValidationError, match="b cannot merge onto itself; name another marker in `onto`"):
        Merge(marker="b", onto="b", first=0, frames=1)


def test_track_quality_flags_the_fault_under_its_kind_and_where_it_is(tmp_path: Path) -> None:
    fault = Merge(marker="tail_4", onto="tail_5", first=90, frames=30)
    session = load_session(make_session(tmp_path / "s", small_plan(slow={"faults": (fault,)})))
    quality = check_tracks(tracks_of(session, "slow"), load_robot())

    (found,) = [flag for flag in quality.flags if flag.kind == fault.kind and fault.marker in flag.markers]
    assert found.frames is not None
    assert abs(found.frames[0] - fault.first) <= 5
    assert abs(found.frames[1] - fault.last) <= 2
    assert (quality.weight[90:120, session.markers.index("tail_4")] == 0).mean() >= 0.8
    assert (quality.weight == 0).sum() <= 1.2 * fault.frames
