import shutil
from pathlib import Path

import numpy as np
import pytest

from swimcal.errors import InputError
from swimcal.robot import load_robot
from swimcal.session import load_session
from tests.swimcal.robots.test_doubts import FILE
from tests.swimcal.sample import MARKERS, SESSION_TOML, faults_of, make_session, tracks_text

CAMERA = """\
[camera]
width_px = 3840
height_px = 2160
fx_px = 2000.0
fy_px = 2000.0
cx_px = 1920.0
cy_px = 1080.0
distortion = [0.1, 0.0, 0.0, 0.0, 0.0]
"""


def test_a_session_loads_with_its_defaults(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "pool")
    session = load_session(folder, load_robot)
    assert (session.name, session.warmup_s, session.seed, session.robot_file) == ("pool", 1.0, 0, None)
    assert (session.camera.fps, session.camera.scale_length_m, session.camera.calibration) == (
        60.0,
        0.142,
        None,
    )
    assert session.markers == MARKERS
    assert [(trial.name, trial.role) for trial in session.trials] == [("slow", "fit"), ("fast", "holdout")]
    assert session.trial("fast").tracks == folder / "fast.csv"
    assert session.results == folder / "results"
    assert not session.results.exists()


def test_robot_and_camera_files_are_read(tmp_path: Path) -> None:
    folder = make_session(
        tmp_path / "pool",
        SESSION_TOML.replace("0.142\n", '0.142\ncalibration = "cam.toml"\n') + '[robot]\nfile = "robot.toml"\n',
    )
    (folder / "cam.toml").write_text(CAMERA)
    shutil.copyfile(FILE, folder / "robot.toml")
    session = load_session(folder, load_robot)
    assert session.robot_file == folder / "robot.toml"
    assert session.camera.calibration is not None
    assert session.camera.calibration.distortion == (0.1, 0.0, 0.0, 0.0, 0.0)
    assert session.camera.calibration.height_above_water_m is None
    names = [path.name for path in session.inputs()]
    assert names == ["session.toml", "robot.toml", "cam.toml", "slow.csv", "fast.csv"]


def test_an_unknown_trial_is_reported_with_the_choices(tmp_path: Path) -> None:
    session = load_session(make_session(tmp_path / "pool"))
    with pytest.raises(InputError, match=r"found 'slwo'; .*choices: slow, fast\. Did you mean 'slow'\?"):
        session.trial("slwo")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("fps = 60.0", "fps = 0", "line 5, camera.fps: wrong value; found 0; expected greater than 0"),
        ("fps = 60.0", "fps = nan", "camera.fps: wrong value; found nan"),
        ("0.142", "0.0", "line 6, camera.scale_length_m: wrong value; found 0.0; expected greater than 0"),
        (
            '"nose", "neck", "tail_1"',
            '"nose", "neck"',
            "markers.names: too few names; found ['nose', 'neck']; expected at least 3",
        ),
        ('"neck"', '"nose"', "two markers of one name; found 'nose', as in line 9, markers.names[0]"),
        ('"neck"', '"ncek"', "marker 'neck' is missing; expected nose and neck among the markers"),
        ('"tail_1"', '"tail 1"', "line 9, markers.names[2]: not a usable name; found 'tail 1'"),
        ('name = "fast"', 'name = "../up"', "line 18, trial[1].name: not a usable name; found '../up'"),
        (
            'name = "fast"',
            'name = "Slow"',
            "line 18, trial[1].name: two trials of one name; found 'Slow', as in line 12, trial[0].name",
        ),
        ('"fast.csv"', '"none.csv"', "line 20, trial[1].tracks: the file is not there; found 'none.csv'"),
        ('"fast.csv"', '"a\\u0000b"', "the file is not there"),
        (
            'tracks = "fast.csv"',
            "",
            "line 17, trial[1]: the trial has no recording; expected at least one of them; "
            "choices: tracks, video, motor",
        ),
        (
            'tracks = "fast.csv"',
            'tracks = "fast.csv"\nboxes = "fast.csv"',
            "trial[1].boxes: boxes without a video",
        ),
        (
            "commanded_hz = 1.5",
            "",
            "line 17, trial[1].commanded_hz: key is missing; expected crank turns a second, for a trial of kind 'swim'",
        ),
        (
            "commanded_hz = 1.5",
            "commanded_hz = 90",
            "line 21, trial[1].commanded_hz: faster than a tail is driven; found 90; "
            "expected crank turns a second, at most 15. Turns a minute? Divide by 60: 1.5.",
        ),
        ('kind = "swim"', 'kind = "swims"', "choices: free_decay, dry, swim. Did you mean 'swim'?"),
        ("[session]", 'robot = "fish.toml"\n[session]', "line 1, robot: wrong value; found 'fish.toml'"),
        ("0.142", '0.142\ncalibration = "slow.csv"', "slow.csv: line 1: not valid TOML"),
    ],
)
def test_a_fault_is_reported_with_its_line_and_what_would_be_right(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in SESSION_TOML
    folder = make_session(tmp_path / "pool", SESSION_TOML.replace(old, new))
    assert message in faults_of(folder)
    assert not (folder / "results").exists()


@pytest.mark.parametrize("scale", ["14.2", "0.05"])
def test_a_scale_length_in_another_unit_is_one_fault_of_the_file(tmp_path: Path, scale: str) -> None:
    message = faults_of(make_session(tmp_path / "pool", SESSION_TOML.replace("0.142", scale)), robot_of=load_robot)
    assert message.endswith(
        f"session.toml: line 6, camera.scale_length_m: not the scale length of the robot; found {scale}; expected "
        "about 0.142 m, from nose to neck of fish_057. Is it in metres, and is the robot right?"
    )


def stamped(folder: Path, spacing_s: np.ndarray) -> None:
    """The tracks of the trial "slow" with stamps that are so far apart."""
    rows = tracks_text(len(spacing_s) + 1).splitlines()
    time_s = np.concatenate([[0.0], np.cumsum(spacing_s)])
    head = "time_s," + ",".join(f"{marker}_{axis}" for marker in MARKERS for axis in "xy")
    lines = (f"{stamp:.6f},{row}" for stamp, row in zip(time_s, rows, strict=True))
    (folder / "slow.csv").write_text("\n".join([head, *lines, ""]))


@pytest.mark.parametrize(("spacing_s", "rate"), [(1 / 20, "20"), (1 / 30, "30"), (1 / 64, "64")])
def test_stamps_of_another_frame_rate_are_refused_once(tmp_path: Path, spacing_s: float, rate: str) -> None:
    folder = make_session(tmp_path / "pool")
    stamped(folder, np.full(89, spacing_s))
    (folder / "fast.csv").write_bytes((folder / "slow.csv").read_bytes())
    assert faults_of(folder).endswith(
        "session.toml: line 5, camera.fps: the time stamps of tracks show another frame rate; found 60; by their "
        f"time_s {rate} in slow, fast; expected 1 / the spacing of time_s, within 5 %. Which of them is right? Correct "
        "the other: frequencies and speeds go by it."
    )


def test_a_trial_may_state_a_frame_rate_of_its_own(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "pool")
    stamped(folder, np.full(89, 1 / 30))
    shutil.copyfile(folder / "slow.csv", folder / "slow_30.csv")
    stamped(folder, np.full(89, 1 / 60))
    shutil.copyfile(folder / "slow.csv", folder / "fast.csv")
    shutil.copyfile(folder / "slow_30.csv", folder / "slow.csv")
    assert "If both are, write fps = 30 into the [[trial]] of slow." in faults_of(folder)
    toml = (folder / "session.toml").read_text()
    (folder / "session.toml").write_text(toml.replace('name = "slow"', 'name = "slow"\nfps = 30.0'))
    session = load_session(folder)
    assert [session.camera_of(trial).fps for trial in session.trials] == [30.0, 60.0]


def test_columns_of_other_names_are_renamed_in_the_file_of_the_session(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "pool")
    stamped(folder, np.full(89, 1 / 60))
    text = (folder / "slow.csv").read_text()
    (folder / "slow.csv").write_text(text.replace(f"{MARKERS[0]}_", "snout_"))
    assert f"column '{MARKERS[0]}_x' is missing" in faults_of(folder)
    toml = (folder / "session.toml").read_text()
    (folder / "session.toml").write_text(toml.replace("[markers]", f'[markers]\nrename = {{snout = "{MARKERS[0]}"}}'))
    assert load_session(folder).rename == {"snout": MARKERS[0]}


def test_stamps_in_milliseconds_are_called_that(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "pool")
    stamped(folder, np.full(89, 1000 / 60))
    assert "slow.csv: the times are not in seconds; found frames 16.67 apart" in faults_of(folder)
    assert "They look like milliseconds" in faults_of(folder)


@pytest.mark.parametrize(
    "spacing_s",
    [
        np.full(89, 1001 / 60000),
        np.where(np.arange(89) % 10, 1, 6) / 60,  # every tenth time five frames are left out
        np.diff(np.round(np.arange(90) / 60, 2)),  # a clock that counts hundredths
    ],
    ids=["59.94", "frames left out", "coarse clock"],
)
def test_stamps_of_about_that_frame_rate_are_taken(tmp_path: Path, spacing_s: np.ndarray) -> None:
    folder = make_session(tmp_path / "pool")
    stamped(folder, spacing_s)
    load_session(folder)


def test_all_faults_of_all_files_come_at_once(tmp_path: Path) -> None:
    toml = SESSION_TOML.replace("60.0", "0.0").replace('"fast"', '"slow"').replace('"holdout"', '"none"')
    folder = make_session(tmp_path / "pool", toml.replace('"fast.csv"', '"none.csv"'))
    (folder / "slow.csv").write_text("1,2,3,4,5,6\n1,2,3\n")
    message = faults_of(folder)
    assert "session.toml: 4 faults" in message
    assert "slow.csv: line 2: wrong number of columns" in message
    assert "slow.csv" not in faults_of(folder, check_tracks=False)


def test_a_misspelt_marker_is_one_fault_not_one_of_every_file(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "pool")
    toml = (folder / "session.toml").read_text()
    (folder / "session.toml").write_text(toml.replace(f'"{MARKERS[-1]}"', '"tial_1"'))
    message = faults_of(folder, robot_of=load_robot)
    assert "found 'tial_1'" in message
    assert "Did you mean 'tail_1'?" in message
    assert "slow.csv" not in message


def test_a_folder_without_a_session_says_how_to_make_one(tmp_path: Path) -> None:
    assert "no session.toml here; expected a session folder with a session.toml" in faults_of(tmp_path)
    assert "Make one with `calib new`." in faults_of(tmp_path / "none")
    make_session(tmp_path / "pool")
    for inside in ("trials", "results/fit.json"):
        assert f"Give {tmp_path / 'pool'}, which has one." in faults_of(tmp_path / "pool" / inside)


EXCHANGED = 'names = ["neck", "nose", "tail_1"]'


@pytest.mark.parametrize("header", [False, True])
@pytest.mark.parametrize("lost", [False, True])
def test_nose_and_neck_exchanged_in_every_trial_are_called_that_once(tmp_path: Path, header: bool, lost: bool) -> None:
    toml = SESSION_TOML if header else SESSION_TOML.replace('names = ["nose", "neck", "tail_1"]', EXCHANGED)
    folder = make_session(tmp_path / "pool", toml)
    for name in ("slow", "fast"):
        rows = [f"{k / 60:.4f},{row}" if header else row for k, row in enumerate(tracks_text().splitlines())]
        if lost:  # unseen at first
            rows[:10] = [row.rsplit(",", 2)[0] + ",," for row in rows[:10]]
        first = "time_s,neck_x,neck_y,nose_x,nose_y,tail_1_x,tail_1_y\n" if header else ""
        (folder / f"{name}.csv").write_text(first + "\n".join(rows) + "\n")
    message = faults_of(folder, robot_of=load_robot)
    assert message.count("nose and neck are exchanged") == 1
    assert "markers.names: nose and neck are exchanged; found in every trial (slow, fast) the markers of" in message
    assert "Exchange the two names" in message


@pytest.mark.parametrize("alone", [True, False])
def test_nose_and_neck_exchanged_in_one_trial_stop_no_other(tmp_path: Path, alone: bool) -> None:
    toml = SESSION_TOML.split("[[trial]]")
    one = "[[trial]]".join([toml[0], next(part for part in toml if "fast" in part)])
    folder = make_session(tmp_path / "pool", one if alone else SESSION_TOML)
    rows = [row.split(",") for row in tracks_text().splitlines()]
    (folder / "fast.csv").write_text("".join(",".join([*r[2:4], *r[:2], *r[4:]]) + "\n" for r in rows))
    if alone:
        message = faults_of(folder, robot_of=load_robot)
        assert "trial[0].tracks: nose and neck are exchanged in trial fast; found the markers of the tail on" in message
    else:
        opened = load_session(folder, load_robot)
        assert [trial.name for trial in opened.trials] == ["slow", "fast"]
