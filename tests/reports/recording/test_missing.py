"""Missing forces in a recording: an arrow that turns with the head, and a line for every joint."""

from pathlib import Path

import numpy as np
import pytest

from reports.recorded_trial import LONGEST, MissingOverTime, arrows_px
from reports.recording import write_recording
from swimcal.robot import load_robot
from tests.reports.diagnoses import JOINTS, made_forces
from tests.reports.recording.contents import read_recording, rows_of
from tests.reports.recording.trials import FRAMES, made_trial
from tests.reports.sample import made_trial as made_swim


def made_missing(along: float = 0.3, across: float = 0.0) -> MissingOverTime:
    """Nothing is known of the first two frames."""
    force = np.zeros((FRAMES, len(JOINTS)))
    force[:, 0], force[:, 1] = along, across
    force[:, -1] = 0.001 * np.arange(FRAMES)
    force[:2] = np.nan
    return MissingOverTime(JOINTS, force)


def test_every_layer_is_in_the_recording(tmp_path: Path) -> None:
    trial = made_trial(missing=made_missing())
    write_recording(tmp_path / "session.rrd", [trial])
    entities = read_recording(tmp_path / "session.rrd").entities

    vectors = rows_of(entities["/f1_00/picture/missing_force"], "Arrows2D:vectors")
    assert [len(row) for row in vectors] == [0, 0, *[1] * (FRAMES - 2)]
    torques = entities["/f1_00/missing_torque_mN_m"]
    assert rows_of(torques, "SeriesLines:names") == [list(JOINTS[2:])]
    assert rows_of(torques, "Scalars:scalars")[10][-1] == pytest.approx(10.0)
    assert rows_of(entities["/f1_00/missing_force_mN"], "SeriesLines:names") == [["head_along", "head_across"]]


@pytest.mark.parametrize(
    ("along", "across", "expected"), [(0.3, 0.0, (1, 0)), (-0.3, 0.0, (-1, 0)), (0.0, 0.3, (0, -1))]
)
def test_the_arrow_points_where_the_force_does(along: float, across: float, expected: tuple[int, int]) -> None:
    """The neck is 20 px to the right of the nose: aft is right, and left of that, seen from above, is up."""
    nose_px = np.zeros((FRAMES, 2))

    arrows = arrows_px(made_missing(along, across), nose_px, nose_px + np.array([20.0, 0.0]))

    np.testing.assert_allclose(arrows[5], 20.0 * LONGEST * np.array(expected), atol=1e-9)
    assert np.isnan(arrows[0]).all()


def test_the_force_follows_the_crank_of_the_twin() -> None:
    swim = made_swim(load_robot(), "fast")
    forces = made_forces(0.004)
    frames = len(swim.measured.time_s)

    missing = MissingOverTime.of(forces, swim, frames + 7, 5)

    assert missing is not None
    known = np.isfinite(missing.force[:, -1])
    np.testing.assert_array_equal(np.flatnonzero(known), 5 + np.flatnonzero(swim.measured.kept))
    turn = swim.phase_rad + 2 * np.pi * swim.simulated_hz * swim.measured.time_s[swim.measured.kept]
    np.testing.assert_allclose(missing.force[known, -1], 0.004 * np.cos(turn), atol=1e-12)


def test_of_a_held_out_swim_no_force_is_known() -> None:
    swim = made_swim(load_robot(), "slow")

    assert MissingOverTime.of(made_forces(), swim, 200, 0) is None
