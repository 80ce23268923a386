"""`calib track`: boxes, what it writes, what it skips, what it says of videos that are not whole."""

import json
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import Fault, InputError
from swimcal.session_file import load_camera
from swimcal.tracks import pixels_of
from tests.calib.door import Front, assert_reports, edit, files_in
from tests.calib.filmed import (
    FRAMES,
    NAMES,
    PLAN,
    change_boxes,
    farthest_px,
    read,
    tracks_of,
    with_tracks,
    without_boxes,
)
from tests.cases import later
from tracking.boxes import load_boxes
from tracking.formats import import_tracks
from tracking.video import Frame, Video


def refuse_to_find(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if no picture showed the markers with certainty."""
    monkeypatch.setattr(import_module("tracking.find_boxes"), "CERTAIN", 2.0)
    monkeypatch.setattr("calib.stages.videos._searched", lambda _frames: [0])


def shades(path: Path) -> bytes:
    return path.read_bytes()[:8]


def test_the_markers_are_found_where_they_are(calib: Front, filmed: Path) -> None:
    outcome = calib("track", filmed)

    assert outcome.code == 0
    assert outcome.out.splitlines()[-1] == str(filmed / "results" / "tracking")
    for name in NAMES:
        assert re.search(rf"^{name} +{FRAMES[name]} +100.00% +100.00% +0.00% +0.00%", outcome.out, re.MULTILINE)
        assert farthest_px(filmed, name) < 0.5
        assert shades(filmed / "results" / "tracking" / f"{name}.boxes.png") == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("lost", ["slow.csv", "slow.states.csv", "raw/slow.csv", "slow.boxes.png"])
def test_a_result_that_is_gone_is_made_again(calib: Front, tracked: Path, lost: str) -> None:
    path = tracked / "results" / "tracking" / lost
    before = path.read_bytes()
    path.unlink()

    assert calib("track", tracked).code == 0
    assert path.read_bytes() == before


def test_boxes_that_are_not_given_are_found_and_kept(calib: Front, filmed: Path) -> None:
    given = load_boxes(filmed / "trials" / "slow.boxes.json", FISHSIM_MARKERS)
    without_boxes(with_tracks(filmed, "fast"), "slow")

    assert calib("track", filmed).code == 0
    found = load_boxes(filmed / "results" / "tracking" / "slow.boxes.json", FISHSIM_MARKERS)
    assert np.abs(found.centres_px(FISHSIM_MARKERS) - given.centres_px(FISHSIM_MARKERS)).max() < 1.0
    assert farthest_px(filmed, "slow") < 0.5
    before = files_in(filmed / "results")
    assert calib("track", filmed).code == 0
    assert files_in(filmed / "results") == before


def test_without_boxes_a_page_is_written_and_they_belong_next_to_the_video_wherever_it_lies(
    calib: Front, filmed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse_to_find(monkeypatch)
    boxes = (filmed / "trials" / "slow.boxes.json").read_bytes()
    without_boxes(with_tracks(filmed, "fast"), "slow")
    edit(filmed / "session.toml", "trials/slow.mp4", "films/slow.mp4")
    (filmed / "films").mkdir()
    (filmed / "trials" / "slow.mp4").rename(filmed / "films" / "slow.mp4")
    place = filmed / "films" / "slow.boxes.json"

    assert_reports(calib("track", filmed), "slow.mp4", "slow.click.html", str(place))
    assert not list((filmed / "results" / "tracking").glob("*.csv"))
    assert "films/slow.boxes.json" in (filmed / "results" / "tracking" / "slow.click.html").read_text()
    place.write_bytes(boxes)
    assert calib("track", filmed).code == 0


def test_a_film_whose_boxes_are_not_found_hides_no_other_film(
    calib: Front, filmed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse_to_find(monkeypatch)
    without_boxes(filmed, "slow")

    outcome = calib("track", filmed, "--export", "deeplabcut")
    assert (outcome.code, "slow.click.html" in outcome.err) == (2, True)
    assert [line.split()[0] for line in outcome.out.splitlines()[:2]] == ["trial", "fast"]
    assert str(filmed / "results" / "tracking" / "fast.dlc.csv") in outcome.out.splitlines()
    assert list(json.loads(calib("track", filmed, "--json").out)) == ["fast"]


def test_a_click_page_can_be_asked_for(calib: Front, filmed: Path) -> None:
    outcome = calib("track", with_tracks(filmed, "fast"), "--click")

    page = filmed / "results" / "tracking" / "slow.click.html"
    assert outcome.out.splitlines() == [str(page)]
    x = json.loads((filmed / "trials" / "slow.boxes.json").read_text())["boxes"]["nose"][0]
    assert str(round(x, 2)) in page.read_text()  # the boxes there are to begin with
    reported = json.loads(calib("track", filmed, "--click", "--json").out)
    assert reported == {"slow": str(page)}
    assert not list((filmed / "results" / "tracking").glob("*.csv"))


def on_water(content: dict[str, Any]) -> None:
    content["boxes"]["nose"][1] += 30


def exchanged(content: dict[str, Any]) -> None:
    boxes = content["boxes"]
    boxes["tail_2"], boxes["tail_4"] = boxes["tail_4"], boxes["tail_2"]


BOXES: dict[str, tuple[Callable[[dict[str, Any]], None], tuple[str, ...]]] = {
    "exchanged": (exchanged, ("slow.boxes.json", "boxes.tail_2", "no place for tail_2", "Exchange tail_2 and tail_4")),
    "on water": (on_water, ("slow.mp4", "frame 0", "boxes without a marker", "nose", "preview")),
}


@pytest.mark.parametrize("case", BOXES)
def test_boxes_that_cannot_be_used_are_reported(calib: Front, filmed: Path, case: str) -> None:
    change, parts = BOXES[case]
    change_boxes(filmed, "slow", change)

    outcome = calib("track", filmed)
    assert "fast" in outcome.out  # the table of the other film
    assert_reports(outcome._replace(out=""), *parts)
    assert not (filmed / "results" / "tracking" / "slow.csv").exists()
    assert not [name for name in files_in(filmed) if ".part." in name]


def test_a_doubtful_box_is_flagged_and_its_samples_count(
    calib: Front, filmed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(import_module("tracking.find_boxes"), "COMMON", -1.0)

    assert calib("track", with_tracks(filmed, "fast")).code == 0
    flags = json.loads((filmed / "results" / "tracking" / "slow.flags.json").read_text())
    flagged = [flag["markers"] for flag in flags if flag["kind"] == "doubtful_box"]
    assert flagged == [[name] for name in FISHSIM_MARKERS]
    assert (read(filmed / "results" / "tracks" / "slow.csv").confidence.values > 0).mean() > 0.9


def without_its_middle(film: bytes) -> bytes:
    """A film of which nothing but the index is left."""
    start = film.index(b"mdat") + 4
    end = film.find(b"moov", start) - 4
    return film[:start] + bytes(max(end, start) - start) + film[max(end, start) :]


SPOILED: dict[str, Callable[[bytes], bytes]] = {
    "cut short": lambda film: film[:2000],
    "no frame": without_its_middle,
}
"""Two ways in which a film cannot be read; `tests/tracking/video/test_damaged_files.py` has all."""


@pytest.mark.parametrize("how", SPOILED)
def test_one_spoiled_film_is_left_out_and_stops_no_other(calib: Front, filmed: Path, how: str) -> None:
    film = filmed / "trials" / "slow.mp4"
    film.write_bytes(SPOILED[how](film.read_bytes()))
    outcome = calib("track", filmed)

    assert outcome.code == 0, outcome.err
    said = [line for line in outcome.out.splitlines() if "slow" in line]
    assert len(said) == 1
    assert said[0].startswith("! slow is left out: slow.mp4: ")
    assert (filmed / "results" / "tracks" / "fast.csv").exists()
    reported = json.loads(calib("track", filmed, "--json").out)
    assert [flag["kind"] for flag in reported["slow"]["flags"]] == ["left_out"]
    assert "tracks" in reported["fast"]


def test_films_that_are_all_spoiled_are_one_error_that_names_each(calib: Front, filmed: Path) -> None:
    for name in NAMES:
        (filmed / "trials" / f"{name}.mp4").write_bytes(b"")

    assert_reports(calib("track", filmed), "trial slow: slow.mp4: empty file", "trial fast: fast.mp4: empty file")


@pytest.mark.parametrize("given", [True, False])
def test_a_film_whose_first_pictures_are_spoiled_is_left_out(
    calib: Front, filmed: Path, given: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not given:
        without_boxes(filmed, "slow")
    decode = Video.frame

    def spoiled(video: Video, number: int) -> Frame:
        if video.info.file.stem == "slow":
            raise InputError([Fault(str(video.info.file), f"frame {number}", "cannot be decoded")])
        return decode(video, number)

    monkeypatch.setattr(Video, "frame", spoiled)
    outcome = calib("track", filmed)

    assert outcome.code == 0, outcome.err
    assert "! slow is left out: slow.mp4: frame 0: cannot be decoded\n" in outcome.out


def test_a_session_without_video_is_reported_so(calib: Front, fresh: Path) -> None:
    outcome = calib("track", fresh)
    assert outcome.code == 0
    assert outcome.out.startswith("No video to track: the tracks of slow and fast are given.\n")
    assert_reports(calib("track", fresh, "--click"), "session.toml", "no video to track", "video = ")


def test_tracks_of_a_file_win_over_the_video(calib: Front, filmed: Path) -> None:
    edit(filmed / "session.toml", 'video = "trials/fast.mp4"', 'tracks = "truth/fast.csv"\nvideo = "trials/fast.mp4"')

    assert set(json.loads(calib("track", filmed, "--json").out)) == {"slow"}


@pytest.mark.parametrize(
    ("form", "suffix"),
    [
        ("swimcal", ".csv"),
        ("deeplabcut", ".dlc.csv"),
        ("movement", ".nc"),
        ("fishsim", ".fishsim.csv"),
    ],
)
def test_tracks_are_exported_in_every_form(calib: Front, tracked: Path, form: str, suffix: str) -> None:
    before = files_in(tracked / "results")
    outcome = calib("track", tracked, "--export", form)

    files = [tracked / "results" / "tracking" / f"{name}{suffix}" for name in NAMES]
    assert outcome.code == 0, outcome.err
    assert all(str(file) in outcome.out.splitlines() for file in files)
    for file, name in zip(files, NAMES, strict=True):
        again = import_tracks(file, FISHSIM_MARKERS, PLAN.camera.fps)
        np.testing.assert_allclose(pixels_of(again), pixels_of(tracks_of(tracked, name)), atol=1e-6)
    assert calib("track", tracked).code == 0
    tracking = {name for name in before if name.startswith("tracking/raw")}
    assert {name: files_in(tracked / "results")[name] for name in tracking} == {n: before[n] for n in tracking}


@pytest.mark.parametrize("method", ["spots", *later("csrt")])
def test_a_fit_keeps_the_tracker_that_was_asked_for(calib: Front, tracked: Path, method: str) -> None:
    with_tracks(tracked, "fast")
    before, tracking = pixels_of(tracks_of(tracked, "slow")), tracked / "results" / "tracking"
    raw = (tracking / "raw" / "slow.csv").stat().st_mtime_ns
    assert calib("track", tracked, "--method", method).code == 0
    chosen, files = pixels_of(tracks_of(tracked, "slow")), files_in(tracking)

    assert files["raw/slow.csv"] > raw
    assert np.array_equal(chosen, before) == (method == "spots")
    Pipeline(open_session(tracked), Options("quick")).recordings.tracks()  # what a fit begins with
    assert calib("track", tracked).code == 0
    assert files_in(tracking) == files
    used = pixels_of(read(tracked / "results" / "tracks" / "slow.csv"))
    np.testing.assert_allclose(used, chosen, atol=1e-6)
    assert calib("track", tracked, "--method", "hybrid").code == 0
    np.testing.assert_array_equal(pixels_of(tracks_of(tracked, "slow")), before)


CAMERA = """
[camera]
width_px = 560
height_px = {}
fx_px = 480.0
fy_px = 480.0
cx_px = 279.5
cy_px = 139.5
{}
"""


@pytest.mark.parametrize(
    ("height_px", "more", "kinds"),
    [
        (280, "height_above_water_m = 1.0", set()),
        (280, "", {"no_camera_height"}),
        (720, "height_above_water_m = 3.0", {"lens_other_size", "camera_height_off_scale"}),
    ],
)
def test_flags_about_the_lens_reach_the_results(
    calib: Front, tracked: Path, height_px: int, more: str, kinds: set[str]
) -> None:
    (tracked / "camera.toml").write_text(CAMERA.format(height_px, more))
    assert load_camera(tracked / "camera.toml").height_px == height_px
    edit(tracked / "session.toml", "fps = 30.0", 'fps = 30.0\ncalibration = "camera.toml"')
    with_tracks(tracked, "fast")

    reported = json.loads(calib("track", tracked, "--json").out)
    assert {flag["kind"] for flag in reported["slow"]["camera"]} == kinds
    trials = Pipeline(open_session(tracked)).trials
    flagged = {trial.name: {flag.kind for flag in trial.flags} for trial in trials}
    assert flagged == {"slow": kinds, "fast": set()}
