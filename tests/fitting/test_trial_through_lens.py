"""A swim filmed through a lens from a known height is measured as if it had been seen flat."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitting import measure_trial
from session import CameraCalibration, load_session, load_tracks
from swimmer import load_robot
from synthetic import make_session
from tests.fitting.swims import PLAN
from tracking import to_pool
from tracking.lens import to_pixels

LENS = CameraCalibration(
    width_px=3840,
    height_px=2160,
    fx_px=2280.0,
    fy_px=2280.0,
    cx_px=1919.5,
    cy_px=1079.5,
    distortion=(-0.05, 0.02, 0.0, 0.0, -0.003),
    height_above_water_m=2.4,
)


def test_lens_and_heights_of_the_markers_are_undone(tmp_path: Path) -> None:
    session, robot = load_session(make_session(tmp_path / "session", PLAN)), load_robot()
    spec = session.trial("fast")
    assert spec.tracks is not None
    flat = load_tracks(spec.tracks, session.markers, session.camera.fps)
    true = to_pool(flat, session.camera)[0]
    above_m = robot.marker_positions_m(flat.markers)[:, 2] - robot.markers["nose"].position_m[2]  # (m,)
    ray = (true - np.nanmean(true, axis=(0, 1))) * [1, -1] / (2.4 - above_m)[:, None]
    filmed = replace(flat, position_px=to_pixels(ray, LENS))

    expected = measure_trial(spec, flat, session.camera, robot, session.warmup_s)
    camera = replace(session.camera, calibration=LENS)
    found = measure_trial(spec, filmed, camera, robot, session.warmup_s)

    assert found.head.shape_m == pytest.approx(expected.head.shape_m, abs=1e-6)
    assert found.speed == pytest.approx(expected.speed, abs=1e-6)
