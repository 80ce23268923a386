import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.sample import FIT_HZ, VIDEO_NAME, WITHHELD, checksums, make_sample, write_checksums
from swimcal.effects.catalogue import catalogue
from swimcal.motor_log import load_motor
from swimcal.robot import load_robot
from swimcal.session import Session, load_session
from swimcal.tracks import load_tracks, pixels_of
from swimsynth.simulate import PULSE_RAD
from tests.swimsynth.plans import measured
from tracking.boxes import load_boxes
from tracking.follow_video import follow_video
from tracking.video import Video

SAMPLE = Path(__file__).resolve().parents[2] / "datasets" / "sample"
FILMED = VIDEO_NAME
DRY = ("dry_0_60", "dry_0_90")
GRID_PX = 0.5


@pytest.fixture(scope="module")
def remade(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_sample(tmp_path_factory.mktemp("remade") / "sample")


def truth() -> dict[str, Any]:
    known: dict[str, Any] = json.loads((SAMPLE / "truth.json").read_text())
    return known


def positions(session: Session, name: str) -> np.ndarray:
    path = session.trial(name).tracks
    assert path is not None
    return pixels_of(load_tracks(path, session.markers, session.camera.fps))


def listed(card: Path) -> dict[str, str]:
    """The files and checksums of a card."""
    return dict(re.findall(r"^\| `([^`]+)` \| `([0-9a-f]{64})` \|$", card.read_text(), re.MULTILINE))


def test_the_checksums_of_the_card_are_those_of_the_files() -> None:
    assert listed(SAMPLE / "CARD.md") == checksums(SAMPLE)


def test_the_card_tells_what_it_must_and_keeps_its_text_when_checksums_are_written(tmp_path: Path) -> None:
    reported = (SAMPLE / "CARD.md").read_text()
    assert all(f"**{part}" in reported for part in ("What", "How made", "Truth", "Seed", "Licence", "Checksums"))
    (tmp_path / "CARD.md").write_text(reported)
    (tmp_path / "truth.json").write_text("{}")
    write_checksums(tmp_path)
    assert (tmp_path / "CARD.md").read_text().startswith(reported.split("| file | sha256 |")[0])
    assert listed(tmp_path / "CARD.md") == checksums(tmp_path)


def test_the_card_tells_the_withheld_effect_and_the_speeds_of_the_truth() -> None:
    card, known = (SAMPLE / "CARD.md").read_text(), truth()
    right, up = (1000 * known["withheld"][key] for key in ("right_m_s", "up_m_s"))
    place = f"in the picture {right:.1f} to the right and {up:.1f} up"

    assert known["withheld"]["effect"] in catalogue()
    assert f"background current of {np.hypot(right, up):.1f} mm/s ({place})" in card
    for name, trial in known["trials"].items():
        assert re.search(rf"^\| {name} \|.*\| {1000 * trial['speed_m_s']:.1f} \|", card, re.MULTILINE)


def test_the_sample_is_small_and_has_what_a_sample_needs() -> None:
    session = load_session(SAMPLE, load_robot)
    swims = [trial for trial in session.trials if trial.kind == "swim"]

    assert sum((SAMPLE / name).stat().st_size for name in checksums(SAMPLE)) < 1_700_000
    assert len({trial.commanded_hz for trial in swims}) >= 5
    assert {trial.commanded_hz for trial in swims if trial.role == "fit"} == set(FIT_HZ)
    assert {trial.kind for trial in session.trials} == {"swim", "dry", "free_decay"}
    assert session.trial(FILMED).role == "holdout"


def test_the_session_does_not_tell_what_is_to_be_found() -> None:
    session = load_session(SAMPLE)

    assert session.robot_file is None
    assert "current" not in (SAMPLE / "session.toml").read_text()
    for name in DRY:
        log = load_motor(SAMPLE / "trials" / f"{name}.motor.csv")
        assert session.trial(name).motor_offset_s == 0.0
        assert log.time_s[0] > 1000  # on a clock of its own


@pytest.mark.parametrize("name", DRY)
def test_in_a_dry_run_the_motor_turns_as_commanded_on_the_mean_as_in_the_swims(name: str) -> None:
    """A motor that loses speed in air but not in water would be a second effect."""
    log, session = load_motor(SAMPLE / "trials" / f"{name}.motor.csv"), load_session(SAMPLE)
    driven = np.abs(log.time_s - log.time_s[0] - 8.1) < 2.5  # between the codes at the start and at the end
    turned, lasted = (float(np.ptp(values[driven])) for values in (log.position_rad, log.time_s))
    assert turned / lasted / (2 * np.pi) == pytest.approx(session.trial(name).commanded_hz, rel=0.006)


@pytest.mark.long
def test_the_sample_is_what_its_module_makes(remade: Path) -> None:
    """To the bit on one machine; on another a sample on the edge may round to the next place of the grid."""
    committed, again = load_session(SAMPLE), load_session(remade)

    assert (SAMPLE / "session.toml").read_text() == (remade / "session.toml").read_text()
    for trial in committed.trials:
        if trial.tracks is None:
            continue
        apart = np.abs(positions(committed, trial.name) - positions(again, trial.name))
        assert apart.max() <= GRID_PX
        assert (apart > 0).mean() < 0.001
    for name in DRY:
        logs = [load_motor(folder / "trials" / f"{name}.motor.csv") for folder in (SAMPLE, remade)]
        commands = [(folder / "trials" / f"{name}.commands.csv").read_text() for folder in (SAMPLE, remade)]
        np.testing.assert_allclose(logs[1].time_s, logs[0].time_s, atol=2e-6)
        np.testing.assert_allclose(logs[1].position_rad, logs[0].position_rad, atol=1.01 * PULSE_RAD)
        assert commands[0] == commands[1]
    known = [json.loads((folder / "truth.json").read_text()) for folder in (SAMPLE, remade)]
    assert known[0]["withheld"] == known[1]["withheld"]
    assert known[0]["withheld"]["right_m_s"] == WITHHELD.right_m_s
    for name, trial in known[0]["trials"].items():
        assert trial["speed_m_s"] == pytest.approx(known[1]["trials"][name]["speed_m_s"], abs=1e-5)


@pytest.mark.long
def test_the_video_of_the_sample_is_what_its_module_makes(remade: Path) -> None:
    """In its truth and boxes; the bytes of the video depend on the encoder."""
    truths = [np.loadtxt(folder / "truth" / f"{FILMED}.csv", delimiter=",", skiprows=1) for folder in (SAMPLE, remade)]
    boxes = [(folder / "trials" / f"{FILMED}.boxes.json").read_text() for folder in (SAMPLE, remade)]

    np.testing.assert_allclose(truths[1], truths[0], atol=1e-3)
    assert boxes[0] == boxes[1]


@pytest.mark.long
def test_the_video_of_the_sample_is_tracked_to_a_tenth_of_a_pixel() -> None:
    session = load_session(SAMPLE)
    spec = session.trial(FILMED)
    assert spec.video is not None
    assert spec.boxes is not None
    exact = load_tracks(SAMPLE / "truth" / f"{FILMED}.csv", session.markers, session.camera.fps)
    with Video(spec.video) as video:
        tracked = follow_video(video, load_boxes(spec.boxes, session.markers), session.markers)

    assert np.isfinite(pixels_of(tracked)).all()
    assert np.sqrt(((pixels_of(tracked) - pixels_of(exact)) ** 2).mean()) < 0.1
    np.testing.assert_allclose(tracked.time.values, exact.time.values, atol=1e-4)


def test_frequency_and_speed_of_the_sample_are_found_and_nothing_is_flagged() -> None:
    known = truth()["trials"]

    for name, trial in measured(SAMPLE).items():
        assert trial.frequency.hz == pytest.approx(known[name]["frequency_hz"], rel=0.01)
        assert trial.speed == pytest.approx(known[name]["speed_m_s"], abs=0.006)
        assert not trial.flags
