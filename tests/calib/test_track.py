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
from calib.results.tracks import FilmedTracks, print_filmed
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import Fault, InputError
from swimcal.session_file import load_camera
from swimcal.tracks import pixels_of
from tests.calib.door import Front, assert_reports, edit, files_in
from tests.calib.filmed import (
    FRAMES,
    NAMES,
    change_boxes,
    farthest_px,
    read,
    tracks_of,
    with_tracks,
    without_boxes,
)
from tests.cases import later
from tracking.boxes import load_boxes
from tracking.formats import FORMATS, export_tracks
from tracking.tracked import as_tracked
from tracking.video import Frame, Video


def refuse_to_find(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if no picture showed the markers with certainty."""
    monkeypatch.setattr(import_module("tracking.find_boxes"), "CERTAIN", 2.0)
    monkeypatch.setattr("calib.stages.videos._searched", lambda _frames: [0])


def test_the_markers_are_found_where_they_are(calib: Front, filmed: Path) -> None:
    outcome = calib("track", filmed)

    assert outcome.code == 0
    assert outcome.out.splitlines()[-1] == str(filmed / "results" / "tracking")
    for name in NAMES:
        assert re.search(rf"^{name} +{FRAMES[name]} +100.00% +100.00% +0.00% +0.00%", outcome.out, re.MULTILINE)
        assert farthest_px(filmed, name) < 0.5
        assert (filmed / "results" / "tracking" / f"{name}.boxes.png").read_bytes().startswith(b"\x89PNG")


def test_columns_are_as_wide_as_the_longest_name(tracked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    session = open_session(tracked)
    own = Pipeline(session).recordings.videos.tracks(session.trial("slow"))
    print_filmed({"slow_against_the_current": own, "fast": own}, FilmedTracks(tracked), (), as_json=False)
    head, *rows = capsys.readouterr().out.splitlines()[:3]
    assert {line.index(word) for line, word in zip((head, *rows), ("frames", "    85", "    85"), strict=True)} == {26}


@pytest.mark.long
@pytest.mark.parametrize("lost", ["slow.csv", "raw/slow.csv"])
def test_a_result_that_is_gone_is_made_again(calib: Front, tracked: Path, lost: str) -> None:
    path = tracked / "results" / "tracking" / lost
    before = path.read_bytes()
    path.unlink()

    assert calib("track", tracked).code == 0
    assert path.read_bytes() == before


@pytest.mark.long
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


@pytest.mark.long
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
    calib: Front, tracked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse_to_find(monkeypatch)
    without_boxes(tracked, "slow")

    outcome = calib("track", tracked, "--export", "deeplabcut")
    assert (outcome.code, "slow.click.html" in outcome.err) == (2, True)
    assert [line.split()[0] for line in outcome.out.splitlines()[:2]] == ["trial", "fast"]
    assert str(tracked / "results" / "tracking" / "fast.dlc.csv") in outcome.out.splitlines()
    assert list(json.loads(calib("track", tracked, "--json").out)) == ["fast"]


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
def test_one_spoiled_film_is_left_out_and_stops_no_other(calib: Front, tracked: Path) -> None:
    film = tracked / "trials" / "slow.mp4"
    film.write_bytes(without_its_middle(film.read_bytes()))
    outcome = calib("track", tracked)

    assert outcome.code == 0, outcome.err
    said = [line for line in outcome.out.splitlines() if "slow" in line]
    assert len(said) == 1
    assert said[0].startswith("! slow is left out: slow.mp4: ")
    assert (tracked / "results" / "tracks" / "fast.csv").exists()
    reported = json.loads(calib("track", tracked, "--json").out)
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


def test_tracks_of_a_file_win_over_the_video(calib: Front, tracked: Path) -> None:
    edit(tracked / "session.toml", 'video = "trials/fast.mp4"', 'tracks = "truth/fast.csv"\nvideo = "trials/fast.mp4"')

    assert set(json.loads(calib("track", tracked, "--json").out)) == {"slow"}


@pytest.mark.long
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
        (720, "height_above_water_m = 3.0", {"lens_other_size", "camera_height_off_scale"}),
        *later((280, "height_above_water_m = 1.0", set()), (280, "", {"no_camera_height"})),
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
    trials = Pipeline(open_session(tracked)).recordings.swims
    flagged = {trial.name: {flag.kind for flag in trial.flags} for trial in trials}
    assert flagged == {"slow": kinds, "fast": set()}


@pytest.mark.parametrize("form", FORMATS)
def test_tracks_of_every_form_become_the_contracts(
    calib: Front, filmed_session: Path, tmp_path: Path, form: str
) -> None:
    true = read(filmed_session / "truth" / "slow.csv")
    export_tracks(as_tracked(true), tmp_path / "theirs", form)
    outcome = calib("convert", tmp_path / "theirs", "--out", tmp_path / "ours.csv", "--fps", "30")

    assert outcome == (0, f"{tmp_path / 'ours.csv'}\n", "")
    ours = read(tmp_path / "ours.csv")
    np.testing.assert_allclose(pixels_of(ours), pixels_of(true), atol=1e-6)
    np.testing.assert_allclose(ours.time.values, true.time.values, atol=1e-5)


CASES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "unknown form": (("--to", "sleap"), ("--to", "'sleap'", "swimcal, deeplabcut, movement")),
    "unknown marker": (("--markers", "nose,tail_9"), ("tail_9",)),
    "a marker twice": (("--markers", "nose,nose"), ("--markers", "each marker once")),
    "two at once": (("--fps", "nan", "--markers", ""), ("2 faults", "--fps", "above 0", "--markers")),
}


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_converted_is_reported(calib: Front, filmed_session: Path, tmp_path: Path, case: str) -> None:
    arguments, parts = CASES[case]
    export_tracks(as_tracked(read(filmed_session / "truth" / "slow.csv")), tmp_path / "dlc.csv", "deeplabcut")

    assert_reports(calib("convert", tmp_path / "dlc.csv", "--out", tmp_path / "o.csv", *arguments), *parts)
    assert not (tmp_path / "o.csv").exists()


def test_a_file_of_another_width_is_reported(calib: Front, filmed_session: Path, tmp_path: Path) -> None:
    true = read(filmed_session / "truth" / "slow.csv")
    export_tracks(as_tracked(true), tmp_path / "f.csv", "fishsim")
    outcome = calib("convert", tmp_path / "f.csv", "--out", tmp_path / "o.csv", "--markers", "nose,neck")

    assert_reports(outcome, "f.csv", "18 in every row", "4: x and y of the 2 markers")
