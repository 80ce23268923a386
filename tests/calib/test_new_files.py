"""`calib new` of one's own videos and tracks."""

import gzip
import shutil
from pathlib import Path

import numpy as np
import pytest

import calib as front
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimcal.session import load_session
from tests.calib.door import ROOT, Front, assert_reports

SAMPLE = ROOT / "datasets" / "sample" / "trials"


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Tracks with time, headerless tracks and a video."""
    folder = tmp_path / "recorded"
    folder.mkdir()
    (folder / "swim f0_60.csv").write_bytes(gzip.decompress((SAMPLE / "f0_60.csv.gz").read_bytes()))
    rows = [line.split(",") for line in (folder / "swim f0_60.csv").read_text().splitlines()[1:]]
    plain = [",".join(cell for number, cell in enumerate(row[1:]) if number % 3 < 2) for row in rows]
    (folder / "f1_00.csv").write_text("\n".join([*plain, ""]))
    shutil.copyfile(SAMPLE / "f1_00_video.mp4", folder / "swim.mp4")
    return folder


def test_a_session_holds_what_the_files_tell_and_says_what_is_missing(calib: Front, own: Path, tmp_path: Path) -> None:
    tracks = (own / "swim f0_60.csv", own / "f1_00.csv")
    outcome = calib("new", tmp_path / "pool", "--videos", own / "swim.mp4", "--tracks", *tracks, "--fps", "60")

    assert outcome.code == 0, outcome.err
    assert outcome.out.splitlines()[-1] == str(tmp_path / "pool")
    assert "to fill in: commanded_hz of swim: commanded crank turns a second" in outcome.out
    text = (tmp_path / "pool" / "session.toml").read_text()
    assert "1280 x 720 px" in text or "frames a second" in text
    assert_reports(calib("fit", tmp_path / "pool"), "commanded_hz", "key is missing")
    (tmp_path / "pool" / "session.toml").write_text(text.replace("# commanded_hz = 1.0", "commanded_hz = 1.0"))
    session = load_session(tmp_path / "pool", load_robot)
    reported = {trial.name: (trial.commanded_hz, trial.role) for trial in session.trials}
    assert reported == {"swim": (1.0, "fit"), "swim_f0_60": (0.6, "holdout"), "f1_00": (1.0, "fit")}
    assert session.camera.fps == pytest.approx(60.0, rel=1e-3)


def test_a_frame_rate_that_the_session_would_refuse_is_refused_at_once(calib: Front, own: Path, tmp_path: Path) -> None:
    given = ("new", tmp_path / "pool", "--tracks", own / "swim f0_60.csv", "--fps", "50")
    assert_reports(calib(*given), "--fps", "found 50; by their time stamps 60 in swim_f0_60", "a session each")
    assert not (tmp_path / "pool").exists()


def test_commands_and_fit_trials_can_be_named(own: Path, tmp_path: Path) -> None:
    tracks = [str(own / "f1_00.csv"), own / "swim f0_60.csv"]
    folder = front.new_session(
        str(tmp_path / "pool"), tracks=tracks, fps=60, commands_hz=[1.1, 0.7], fit=["swim_f0_60"]
    )
    session = front.open_session(folder)
    assert {trial.name: (trial.commanded_hz, trial.role) for trial in session.trials} == {
        "f1_00": (1.1, "holdout"),
        "swim_f0_60": (0.7, "fit"),
    }


def test_tracks_go_to_a_session_and_back_as_datasets(own: Path, tmp_path: Path) -> None:
    markers = FISHSIM_MARKERS
    data = front.load_tracks(own / "swim f0_60.csv", markers)
    folder = front.new_session(tmp_path / "pool", tracks={"f0_60": data})
    again = front.track(folder, progress=False)["f0_60"]
    np.testing.assert_array_equal(again.position, data.position)
    assert again.position_head.dims == ("time", "space", "keypoint")


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--tracks", "{own}/f1_00.csv"), ("f1_00.csv: the file has no time", "--fps 60")),
        (("--tracks", "{own}/f1_00.csv", "--fps", "60", "--commands", "1,2"), ("--commands", "found 2", "expected 1")),
        (("--tracks", "{own}/none.csv", "--videos", "{own}/none.mp4"), ("none.csv", "none.mp4")),
        (("--tracks", "{own}/f1_00.csv", "--fps", "60", "--fit", "f9"), ("no such trial to fit", "f1_00")),
    ],
)
def test_faults_are_reported_at_once_and_nothing_is_left(
    calib: Front, own: Path, tmp_path: Path, options: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    assert_reports(calib("new", tmp_path / "pool", *(option.format(own=own) for option in options)), *parts)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["recorded"]


def test_a_session_like_another_repeats_its_commands_roles_robot_and_lens(own: Path, tmp_path: Path) -> None:
    tracks = [own / "f1_00.csv", own / "swim f0_60.csv"]
    healthy = front.new_session(tmp_path / "healthy", tracks=tracks, fps=60, commands_hz=[1.1, 0.7], fit=["f1_00"])
    lens = "[camera]\nwidth_px = 1280\nheight_px = 720\nfx_px = 900.0\nfy_px = 900.0\ncx_px = 640.0\ncy_px = 360.0\n"
    (healthy / "camera.toml").write_text(lens)
    toml = healthy / "session.toml"
    toml.write_text(toml.read_text().replace("# calibration", "calibration"))

    other = front.open_session(front.new_session(tmp_path / "changed", tracks=tracks, like=healthy))

    assert {trial.name: (trial.commanded_hz, trial.role) for trial in other.trials} == {
        "f1_00": (1.1, "fit"),
        "swim_f0_60": (0.7, "holdout"),
    }
    assert other.camera.fps == pytest.approx(60.0)
    assert other.camera.calibration == front.open_session(healthy).camera.calibration is not None


def test_trials_without_a_counterpart_are_told(calib: Front, own: Path, tmp_path: Path) -> None:
    healthy = front.new_session(tmp_path / "healthy", tracks=own / "f1_00.csv", fps=60, fit=["f1_00"])
    outcome = calib("new", tmp_path / "changed", "--tracks", own / "swim f0_60.csv", "--like", healthy)
    assert outcome.code == 0, outcome.err
    assert "no trial of healthy has the name of swim_f0_60" in outcome.out
    assert "healthy also has f1_00" in outcome.out


def test_a_reference_must_be_another_session_of_the_same_robot(calib: Front, own: Path, tmp_path: Path) -> None:
    given = {"tracks": own / "f1_00.csv", "fps": 60, "fit": ["f1_00"]}
    session = front.new_session(tmp_path / "one", **given)
    assert_reports(calib("diagnose", session, "--reference", session), "a session is its own reference")
    usual = ROOT / "swimcal" / "robots" / "fish_057.toml"
    heavy = tmp_path / "heavy.toml"
    heavy.write_text(usual.read_text().replace("density_kg_m3 = 1000.0", "density_kg_m3 = 1025.0", 1))
    other = front.new_session(tmp_path / "other", robot=heavy, **given)
    assert_reports(calib("diagnose", other, "--reference", session), "another robot than the reference's")
    assert not (other / "results" / "calibration.json").exists()
    assert not (session / "results" / "calibration.json").exists()
