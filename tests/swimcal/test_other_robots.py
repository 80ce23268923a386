"""Another tendon-driven swimmer needs nothing but another TOML, from its MJCF to a measured session."""

from pathlib import Path

import numpy as np
import pytest

from fitting.measure_trial import measure_trial
from swimcal.robot import RobotSpec, load_robot
from swimcal.session import load_session
from swimcal.tracks import load_tracks
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS, SyntheticPlan, SyntheticTrial
from swimsynth.session import make_session, read_truth
from tests.swimcal.robots import SEVEN_LINK, THREE_LINK, every_robot
from tests.swimcal.swims import runs

others = pytest.mark.parametrize("robot", [THREE_LINK, SEVEN_LINK], ids=lambda robot: robot.name)


@every_robot
def test_it_swims_forward_and_faster_when_the_crank_turns_faster(robot: RobotSpec) -> None:
    """From a push of the usual speed; slow swims of the twin have a backward steady state as well."""
    push = np.tile([-0.15, 0.0, 0.0], (2, 1))
    two = runs([0.6, 1.0], 0.5, PLAUSIBLE_COEFFICIENTS, velocity=push)
    head = Twin(robot).simulate(two, np.array([5.0, 10.0])).head
    speed = np.linalg.norm(head[:, 1, :2] - head[:, 0, :2], axis=1) / 5.0
    heading = -np.stack([np.cos(head[:, 0, 2]), np.sin(head[:, 0, 2])], axis=1)
    assert ((head[:, 1, :2] - head[:, 0, :2]) * heading).sum(axis=1).min() > 0
    assert 0.02 < speed[0] < speed[1] < 0.5


@others
def test_a_session_with_its_markers_is_measured(robot: RobotSpec, tmp_path: Path) -> None:
    trial = SyntheticTrial(name="swim", frequency_hz=0.97, commanded_hz=1.0, seconds=4.0)
    plan = SyntheticPlan(trials=(trial,), robot=robot, markers=tuple(robot.markers), run_in_s=4.0)
    folder = make_session(tmp_path / "session", plan)

    session = load_session(folder)
    found = load_robot(session.robot_file)
    spec = session.trials[0]
    assert spec.tracks is not None
    tracks = load_tracks(spec.tracks, session.markers, session.camera.fps)
    measured = measure_trial(spec, tracks, session.camera, found, session.warmup_s)

    assert found == robot
    truth = read_truth(folder).trials["swim"]
    assert measured.markers == tuple(robot.markers)
    assert measured.frequency.hz == pytest.approx(truth.frequency_hz, rel=0.01)
    assert measured.speed == pytest.approx(truth.speed_m_s, abs=0.01)
    assert measured.used_fraction > 0.95
