"""`calib new` of files as people have them: names, copies, links, clocks, names of markers."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import calib as front
from calib.new import trial_names, without_copies
from tests.calib.door import ROOT, Front, assert_reports

SAMPLE = ROOT / "datasets" / "sample" / "trials"


@pytest.mark.parametrize(
    ("videos", "names"),
    [
        (["day1/GX01.MP4", "day2/GX01.MP4"], ["day1_GX01", "day2_GX01"]),
        (["a/x/swim.mp4", "b/x/swim.mp4"], ["a_x_swim", "b_x_swim"]),
        (["F1_30.mp4", "f1_30.mp4"], ["F1_30", "f1_30_2"]),
        (["鱼.mp4", "龟.mp4"], ["trial", "trial_2"]),
        (["schwömm ß.mp4", "12:30 f1_00.mp4"], ["schwomm_ss", "12_30_f1_00"]),
        (["swim.mp4", "swim.mov"], ["swim", "swim_2"]),
    ],
)
def test_every_video_has_a_name_of_its_own(videos: list[str], names: list[str]) -> None:
    assert trial_names([Path(video) for video in videos], [], False)[0] == names


def test_video_and_tracks_of_one_name_and_folder_are_one_trial() -> None:
    videos, tracks = trial_names([Path("d1/a.mp4"), Path("d2/a.mp4")], [Path("d2/a.csv"), Path("d1/a.csv.gz")], False)
    assert (videos, tracks) == (["d1_a", "d2_a"], ["d2_a", "d1_a"])


@pytest.mark.parametrize(
    ("copy", "video"),
    [("GOPR0001.LRV", "GOPR0001.MP4"), ("GL010001.LRV", "GX010001.MP4"), ("DJI_0007.LRF", "DJI_0007.MP4")],
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


def test_a_decay_of_another_clock_is_refused_like_a_swim(calib: Front, tmp_path: Path) -> None:
    shutil.copyfile(SAMPLE / "decay_1.csv.gz", tmp_path / "decay.csv.gz")
    outcome = calib("new", tmp_path / "s", "--fps", "50", "--tracks", tmp_path / "decay.csv.gz")
    assert_reports(outcome, "--fps", "found 50; by their time stamps 60 in decay")
    assert not (tmp_path / "s").exists()


def test_a_session_without_commands_opens_and_fits_only_with_them(calib: Front, tmp_path: Path) -> None:
    shutil.copyfile(SAMPLE / "f0_60.csv.gz", tmp_path / "swim.csv.gz")
    folder = front.new_session(tmp_path / "s", tracks=tmp_path / "swim.csv.gz")
    assert front.open_session(folder).trial("swim").commanded_hz is None
    assert front.track(folder, progress=False)["swim"].sizes["time"] > 100
    assert_reports(calib("fit", folder), "commanded_hz", "key is missing")


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
