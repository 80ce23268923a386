"""`calib new`: sessions from public tracks and from the twin."""

import gzip
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import calib as front
from calib.pipeline import open_session
from calib.trial_names import trial_names, without_copies
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimcal.session import load_session
from swimsynth.session import read_truth
from tests.calib.door import ROOT, Front, assert_reports, edit
from tests.swimcal.sample import FISHSIM, needs_fishsim


@needs_fishsim
def test_public_tracks_become_a_session(calib: Front, tmp_path: Path) -> None:
    outcome = calib("new", tmp_path / "s", "--from-fishsim", FISHSIM, "--fit", "f1_00, f1_75")

    assert (outcome.code, outcome.out) == (0, f"{tmp_path / 's'}\n")
    session = open_session(tmp_path / "s")
    assert {t.name: t.role for t in session.trials} == {
        "f0_50": "holdout",
        "f0_75": "holdout",
        "f1_00": "fit",
        "f1_25": "holdout",
        "f1_75": "fit",
    }


def tracks_of_a_checkout(folder: Path) -> Path:
    """As in the authors' repository: `Data/Markers/markers_f1_00.csv`."""
    place = folder / "Data" / "Markers"
    place.mkdir(parents=True)
    row = ",".join(f"{100 + 40 * k}.0,{200 + k}.5" for k in range(9))
    (place / "markers_f1_00.csv").write_text(f"{row}\n" * 90)
    return folder


def test_a_trial_to_fit_that_is_not_there_is_refused_and_nothing_made(calib: Front, tmp_path: Path) -> None:
    source = tracks_of_a_checkout(tmp_path / "fishsim")

    assert_reports(calib("new", tmp_path / "s", "--from-fishsim", source, "--fit", "f1_0"), "'f1_0'", "choices: f1_00")
    assert not (tmp_path / "s").exists()


@pytest.mark.long
def test_a_synthetic_session_is_of_the_robot_that_was_given(calib: Front, tmp_path: Path) -> None:
    file = ROOT / "tests" / "swimcal" / "robots" / "three_link.toml"
    assert calib("new", tmp_path / "s", "--synthetic", "--robot", file).code == 0

    session, expected = open_session(tmp_path / "s"), load_robot(file)
    assert load_robot(session.robot_file) == expected
    assert session.markers == tuple(expected.markers)
    assert {trial.kind for trial in session.trials} == {"swim", "dry", "free_decay"}
    decays = read_truth(tmp_path / "s").plan.free_decays
    assert [len(decay.bent_rad) for decay in decays] == [len(expected.hinges)] * 3


@pytest.mark.parametrize(
    ("options", "faults"),
    [
        (("--synthetic", "--fps", "30", "--fit", "f0_40"), ("--fps", "--fit")),
        (("--from-fishsim", "x", "--robot", "six.toml", "--seed", "3"), ("--robot", "--seed")),
        (("--synthetic", "--from-fishsim", "x", "--commands", "1,2"), ("several sources of trials", "--commands")),
    ],
)
def test_options_that_do_not_go_together_are_reported_at_once(
    calib: Front, tmp_path: Path, options: tuple[str, ...], faults: tuple[str, ...]
) -> None:
    outcome = calib("new", tmp_path / "s", *options)

    assert_reports(outcome, *(f"{fault}: means nothing with" for fault in faults if fault.startswith("--")))
    assert_reports(outcome, *faults)
    assert not (tmp_path / "s").exists()


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
    assert_reports(calib(*given), "--fps", "found 50; by their time stamps 60 in swim_f0_60", "with its own fps")
    assert not (tmp_path / "pool").exists()


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
    third = front.new_session(tmp_path / "third", **given)
    edit(third / "session.toml", "scale_length_m = 0.142", "scale_length_m = 0.145")
    assert_reports(
        calib("diagnose", third, "--reference", session), "scale_length_m", "another distance from nose to neck"
    )
    assert not (other / "results" / "calibration.json").exists()
    assert not (session / "results" / "calibration.json").exists()


@pytest.mark.parametrize(
    ("videos", "names"),
    [
        (["day1/GX01.MP4", "day2/GX01.MP4"], ["day1_GX01", "day2_GX01"]),
        (["F1_30.mp4", "f1_30.mp4"], ["F1_30", "f1_30_2"]),
        (["鱼.mp4", "龟.mp4"], ["trial", "trial_2"]),
        (["schwömm ß.mp4", "12:30 f1_00.mp4"], ["schwomm_ss", "12_30_f1_00"]),
        (["swim.mp4", "swim.mov"], ["swim", "swim_2"]),
    ],
)
def test_every_video_has_a_name_of_its_own(videos: list[str], names: list[str]) -> None:
    assert trial_names([Path(video) for video in videos], [], False)[0] == names


@pytest.mark.parametrize(
    ("copy", "video"),
    [("GOPR0001.LRV", "GOPR0001.MP4"), ("DJI_0007.LRF", "DJI_0007.MP4")],
)
def test_the_small_copy_of_a_camera_is_left_out_and_named(copy: str, video: str) -> None:
    kept, (note,) = without_copies([Path(video), Path(copy)])
    assert kept == [Path(video)]
    assert copy in note
    assert without_copies([Path(copy)]) == ([Path(copy)], [])


def test_a_file_that_is_given_twice_is_refused(calib: Front, tmp_path: Path) -> None:
    shutil.copyfile(SAMPLE / "f0_60.csv.gz", tmp_path / "a.csv.gz")
    (tmp_path / "b.csv.gz").symlink_to("a.csv.gz")
    outcome = calib("new", tmp_path / "s", "--tracks", tmp_path / "a.csv.gz", tmp_path / "b.csv.gz")
    assert_reports(outcome, "--tracks: a file is given twice", "a.csv.gz", "b.csv.gz")


def test_files_that_cannot_be_followed_or_spelt_are_named(calib: Front, tmp_path: Path) -> None:
    (tmp_path / "a.csv").symlink_to("b.csv")
    (tmp_path / "b.csv").symlink_to("a.csv")
    odd = os.fsdecode(os.fsencode(tmp_path) + b"/l\xfc.csv")
    outcome = calib("new", tmp_path / "s", "--tracks", tmp_path / "a.csv", odd)
    assert_reports(outcome, "a link that leads nowhere", "a name that is not UTF-8", "l\\udcfc.csv")


def test_missing_frames_make_no_other_frame_rate(calib: Front, tmp_path: Path) -> None:
    """Nor does a line break in a name break the comment that holds it."""
    lines = gzip.decompress((SAMPLE / "f0_60.csv.gz").read_bytes()).decode().splitlines(keepends=True)
    whole, gappy = tmp_path / "whole.csv", tmp_path / "two\nlines.csv"
    whole.write_text("".join(lines))
    gappy.write_text("".join(lines[:1] + [line for number, line in enumerate(lines[1:]) if number % 6]))
    outcome = calib("new", tmp_path / "s", "--tracks", whole, gappy)
    assert not outcome.code, outcome.err
    assert "fps = 60\n" in (tmp_path / "s" / "session.toml").read_text()
    assert front.open_session(tmp_path / "s").camera.fps == 60


def test_markers_are_renamed_and_left_out_ones_are_named(calib: Front, tmp_path: Path) -> None:
    data = front.load_tracks(SAMPLE / "f0_60.csv.gz", front.open_session(ROOT / "datasets" / "sample").markers)
    theirs = ["snout", *data.keypoint.values[1:-1].tolist(), "fluke"]
    front.convert_tracks(
        SAMPLE / "f0_60.csv.gz", tmp_path / "f0_60.csv", "deeplabcut", markers=data.keypoint.values.tolist()
    )
    text = (tmp_path / "f0_60.csv").read_text()
    (tmp_path / "f0_60.csv").write_text(text.replace("nose", "snout").replace("caudal_fin", "fluke"))
    given = ("--tracks", tmp_path / "f0_60.csv", "--fps", "60")
    refused = calib("new", tmp_path / "s", *given)
    assert_reports(refused, ", ".join(theirs), "--rename snout=nose")
    assert calib("new", tmp_path / "s", *given, "--rename", "snout=nose, fluke=caudal_fin").code == 0
    again = front.track(tmp_path / "s", progress=False)["f0_60"]
    np.testing.assert_array_equal(again.position, data.position)
    assert calib("new", tmp_path / "t", *given, "--rename", "snout").code == 2


def test_a_name_is_renamed_in_the_files_that_have_it_and_refused_where_none_has(calib: Front, tmp_path: Path) -> None:
    """Files of two programs: one calls the nose snout, the other as we do."""
    lines = gzip.decompress((SAMPLE / "f0_60.csv.gz").read_bytes()).decode()
    ours, theirs = tmp_path / "f0_60.csv", tmp_path / "f1_00.csv"
    ours.write_text(lines)
    theirs.write_text(lines.replace("nose_", "snout_"))
    given = ("--tracks", ours, theirs)
    outcome = calib("new", tmp_path / "s", *given, "--rename", "snout=nose")
    assert not outcome.code, outcome.err
    assert set(front.track(tmp_path / "s", progress=False)) == {"f0_60", "f1_00"}
    refused = calib("new", tmp_path / "t", *given, "--rename", "snout=nose,fin=caudal_fin")
    assert_reports(refused, "no file has this name to rename; found fin;", "f0_60.csv has nose", "f1_00.csv has snout")
    assert refused.err.count("to rename") == 1


@pytest.mark.parametrize(("second", "told"), [("f1_00", 1), ("f0_60_again", 0)])
def test_of_two_swims_the_one_held_out_is_said_to_be_beyond_the_other(
    calib: Front, tmp_path: Path, second: str, told: int
) -> None:
    for name in ("f0_60", second):
        (tmp_path / f"{name}.csv").write_bytes(gzip.decompress((SAMPLE / "f0_60.csv.gz").read_bytes()))
    outcome = calib("new", tmp_path / "s", "--tracks", tmp_path / "f0_60.csv", tmp_path / f"{second}.csv")
    assert outcome.out.count(f"note: {second} is outside the range of the one fitted swim: film a third one") == told


def dataset(names: list[str]) -> xr.Dataset:
    """Tracks as the package movement has them in memory."""
    place = np.random.default_rng(0).uniform(100, 400, (60, 2, len(names), 1))
    dimensions = ("time", "space", "keypoint", "individual")
    certain = (("time", "keypoint", "individual"), np.ones((60, len(names), 1)))
    where = {"time": np.arange(60) / 60, "space": ["x", "y"], "keypoint": names, "individual": ["fish"]}
    return xr.Dataset({"position": (dimensions, place), "confidence": certain}, where, {"fps": 60})


@pytest.mark.parametrize(
    ("tracks", "rename", "what"),
    [
        ({"swim": dataset(["nose", "neck", "tail_1", "t1"])}, {"t1": "tail_1"}, "found tail_1 and t1 as tail_1"),
        ([dataset(["nose", "neck", "tail_1"])], {}, "datasets have no names"),
        ({"swim": dataset(["nose", "neck", "tail_1"]).position}, {}, "found DataArray; expected paths"),
        ({"swim": np.zeros((60, 3, 2))}, {}, "found ndarray; expected paths"),
    ],
)
def test_tracks_in_memory_that_cannot_be_used_are_named(
    tracks: Any, rename: dict[str, str], what: str, tmp_path: Path
) -> None:
    with pytest.raises(front.InputError, match=what):
        front.new_session(tmp_path / "s", tracks=tracks, rename=rename)
    assert not (tmp_path / "s").exists()
