from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.video.filmed import SessionVideo
from swimcal.session import load_session
from swimcal.tracks import load_tracks, pixels_of
from swimsynth.disturbances import NOISELESS
from swimsynth.plan import Merge, SyntheticCamera
from swimsynth.session import make_session, read_truth
from tests.benchmarks.video.test_writer import decoded
from tests.swimsynth.plans import files_of, small_plan, tracks_of

CAMERA = SyntheticCamera(fps=12.0, px_per_m=480.0, width_px=640, height_px=480)
SHORT: dict[str, Any] = {"seconds": 1.5}


def film(folder: Path, video: SessionVideo, **changes: Any) -> Path:
    return make_session(folder, small_plan(camera=CAMERA, **{"slow": SHORT} | changes), video)


@pytest.mark.long
def test_a_filmed_trial_shows_its_markers_where_perfect_tracks_have_them(tmp_path: Path) -> None:
    folder = film(tmp_path / "s", SessionVideo(trials=("slow",)))
    perfect = make_session(tmp_path / "p", small_plan(camera=CAMERA, slow=SHORT, noise=NOISELESS))
    session = load_session(folder)
    trial = session.trial("slow")

    assert trial.tracks is None
    assert trial.video is not None
    assert trial.boxes is not None
    assert session.trial("fast").video is None
    expected = tracks_of(load_session(perfect), "slow")
    true = load_tracks(folder / "truth" / "slow.csv", session.markers, session.camera.fps)
    np.testing.assert_allclose(pixels_of(true), pixels_of(expected), atol=0.1)  # blurred, and rounded
    time_s, pictures = decoded(trial.video, "gray")
    np.testing.assert_allclose(time_s, expected.time.values, atol=1e-4)
    for number in (0, -1):
        for x, y in pixels_of(true)[number]:
            assert pictures[number][round(y), round(x)] > 190
    boxes = json.loads(trial.boxes.read_text())["boxes"]
    assert tuple(boxes) == session.markers


def test_the_errors_of_a_tracker_are_left_out_of_what_is_filmed(tmp_path: Path) -> None:
    faulty = SHORT | {"faults": (Merge(marker="tail_2", onto="tail_3", first=3, frames=5),)}
    some = read_truth(film(tmp_path / "some", SessionVideo(trials=("slow",)), slow=faulty))
    tracked = make_session(tmp_path / "tracked", small_plan(camera=CAMERA, slow=SHORT))

    assert some.plan.trials[0].faults == ()
    assert not np.any(list(some.trials["slow"].placement_px.values()))
    assert some.plan.noise != NOISELESS
    assert files_of(tmp_path / "some")["trials/fast.csv.gz"] == files_of(tracked)["trials/fast.csv.gz"]


@pytest.mark.long
def test_a_cropped_video_shows_the_middle_of_the_image(tmp_path: Path) -> None:
    folders = [
        film(tmp_path / str(width), SessionVideo(trials=("slow",), width_px=width, height_px=height))
        for width, height in ((None, None), (560, 400))
    ]
    whole, cropped = (
        load_tracks(folder / "truth" / "slow.csv", load_session(folder).markers, 12.0) for folder in folders
    )

    np.testing.assert_allclose(pixels_of(whole) - pixels_of(cropped), np.full(pixels_of(whole).shape, 40), atol=0.02)
