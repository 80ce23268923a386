import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.sample import checksums, make_sample, sample_plan, write_checksums
from session import Session, load_session
from session.motor import load_motor
from session.tracks import load_tracks, pixels_of
from swimmer import load_robot
from synthetic.motor_log import PULSE_RAD
from synthetic.truth import Truth, read_truth
from tests.synthetic.plans import measured
from tracking.boxes import load_boxes
from tracking.tracker import follow_video
from tracking.video import Video

SAMPLE = Path(__file__).resolve().parents[2] / "datasets" / "sample"
GRID_PX = 0.5


@pytest.fixture(scope="module")
def remade(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_sample(tmp_path_factory.mktemp("remade") / "sample")


def positions(session: Session, name: str) -> np.ndarray:
    path = session.trial(name).tracks
    assert path is not None
    return pixels_of(load_tracks(path, session.markers, session.camera.fps))


def listed(card: Path) -> dict[str, str]:
    """The files and checksums of a card."""
    return dict(re.findall(r"^\| `([^`]+)` \| `([0-9a-f]{64})` \|$", card.read_text(), re.MULTILINE))


def test_the_checksums_of_the_card_are_those_of_the_files() -> None:
    assert listed(SAMPLE / "CARD.md") == checksums(SAMPLE)
    logs = 2 * len(sample_plan().dry_runs)  # of motors, and their commands
    assert len(checksums(SAMPLE)) == 2 + len(sample_plan().all_trials) + 2 + logs  # 2: boxes and truth of the video


def test_the_card_tells_what_it_must_and_keeps_its_text_when_checksums_are_written(tmp_path: Path) -> None:
    reported = (SAMPLE / "CARD.md").read_text()
    assert all(f"**{part}" in reported for part in ("What", "How made", "Truth", "Seed", "Licence", "Checksums"))
    (tmp_path / "CARD.md").write_text(reported)
    (tmp_path / "truth.json").write_text("{}")
    write_checksums(tmp_path)
    assert (tmp_path / "CARD.md").read_text().startswith(reported.split("| file | sha256 |")[0])
    assert listed(tmp_path / "CARD.md") == checksums(tmp_path)


def test_the_sample_is_small_and_has_what_a_sample_needs() -> None:
    session = load_session(SAMPLE, load_robot)
    plan = read_truth(SAMPLE).plan

    assert sum((SAMPLE / name).stat().st_size for name in checksums(SAMPLE)) < 1_600_000
    assert len({trial.commanded_hz for trial in session.trials}) >= 5
    assert {trial.role for trial in session.trials} == {"fit", "holdout"}
    assert sum(len(trial.faults) for trial in plan.trials) == 1
    assert plan.noise.sd_px > 0


@pytest.mark.long
def test_the_sample_is_what_its_plan_makes(remade: Path) -> None:
    """To the bit on one machine; on another a sample on the edge may round to the next place of the grid."""
    committed, again = load_session(SAMPLE), load_session(remade)

    assert (SAMPLE / "session.toml").read_text() == (remade / "session.toml").read_text()
    assert len(committed.trials) == len(sample_plan().all_trials)
    for trial in committed.trials:
        if trial.tracks is None:
            continue
        apart = np.abs(positions(committed, trial.name) - positions(again, trial.name))
        assert apart.max() <= GRID_PX
        assert (apart > 0).mean() < 0.001


@pytest.mark.long
def test_the_motor_logs_of_the_sample_are_what_its_plan_makes(remade: Path) -> None:
    """To a step of the encoder."""
    for run in sample_plan().dry_runs:
        logs = [load_motor(folder / "trials" / f"{run.name}.motor.csv") for folder in (SAMPLE, remade)]
        commands = [(folder / "trials" / f"{run.name}.commands.csv").read_text() for folder in (SAMPLE, remade)]

        np.testing.assert_allclose(logs[1].time_s, logs[0].time_s, atol=2e-6)
        np.testing.assert_allclose(logs[1].position_rad, logs[0].position_rad, atol=1.01 * PULSE_RAD)
        assert commands[0] == commands[1]


def test_the_session_does_not_tell_what_the_dry_experiments_are_to_find() -> None:
    session = load_session(SAMPLE)

    assert session.robot_file is None
    assert {trial.kind for trial in session.trials} == {"swim", "dry", "free_decay"}
    for run in sample_plan().dry_runs:
        assert session.trial(run.name).motor_offset_s == 0.0
        assert run.motor is not None
        assert abs(run.motor.clock_offset_s) > 1000


@pytest.mark.long
def test_the_video_of_the_sample_is_what_its_plan_makes(remade: Path) -> None:
    """In its truth and boxes; the bytes of the video depend on the encoder."""
    truths = [
        np.loadtxt(folder / "truth" / "f1_00_video.csv", delimiter=",", skiprows=1) for folder in (SAMPLE, remade)
    ]
    boxes = [(folder / "trials" / "f1_00_video.boxes.json").read_text() for folder in (SAMPLE, remade)]

    np.testing.assert_allclose(truths[1], truths[0], atol=1e-3)
    assert boxes[0] == boxes[1]


@pytest.mark.long
def test_the_video_of_the_sample_is_tracked_to_a_tenth_of_a_pixel() -> None:
    session = load_session(SAMPLE)
    spec = session.trial("f1_00_video")
    assert spec.video is not None
    assert spec.boxes is not None
    truth = load_tracks(SAMPLE / "truth" / "f1_00_video.csv", session.markers, session.camera.fps)
    with Video(spec.video) as video:
        tracked = follow_video(video, load_boxes(spec.boxes, session.markers), session.markers)

    assert np.isfinite(pixels_of(tracked)).all()
    assert np.sqrt(((pixels_of(tracked) - pixels_of(truth)) ** 2).mean()) < 0.1
    np.testing.assert_allclose(tracked.time.values, truth.time.values, atol=1e-4)


@pytest.mark.long
def test_the_truth_of_the_sample_is_what_its_plan_makes(remade: Path) -> None:
    committed, again = read_truth(SAMPLE), read_truth(remade)

    assert committed.plan == again.plan == sample_plan()
    for name, trial in committed.trials.items():
        assert trial.speed_m_s == pytest.approx(again.trials[name].speed_m_s, abs=1e-5)
        assert trial.frequency_hz == pytest.approx(again.trials[name].frequency_hz, rel=1e-6)
        assert trial.phase_rad == pytest.approx(again.trials[name].phase_rad, abs=1e-5)
    for name, run in committed.dry_runs.items():
        assert run.frequency_hz == pytest.approx(again.dry_runs[name].frequency_hz, rel=1e-6)
        assert run.steady_s == pytest.approx(again.dry_runs[name].steady_s, abs=1e-6)
    assert committed.structure.natural_hz == pytest.approx(again.structure.natural_hz, rel=1e-6)


def test_frequency_speed_and_fault_of_the_sample_are_found() -> None:
    truth: Truth = read_truth(SAMPLE)
    planned = {trial.name: trial for trial in truth.plan.trials}

    for name, trial in measured(SAMPLE).items():
        assert trial.frequency.hz == pytest.approx(truth.trials[name].frequency_hz, rel=0.01)
        assert trial.speed == pytest.approx(truth.trials[name].speed_m_s, abs=0.006)
        found = [(flag.kind, flag.markers[0]) for flag in trial.flags]
        assert found == [(fault.kind, fault.marker) for fault in planned[name].faults]
