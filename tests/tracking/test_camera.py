"""From pixels to the pool: the true distances come back through lens, heights and perspective."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from swimcal.errors import InputError, NotEnoughData
from swimcal.robot import load_robot
from swimcal.session_file import CameraCalibration, CameraSpec
from swimcal.tracks import as_tracks, pixels_of
from tests.tracking.lens.render import lens_of, to_pixels
from tracking.camera import to_pool

ROBOT = load_robot()
MARKERS = tuple(ROBOT.markers)
PLACE_M = ROBOT.marker_positions_m(MARKERS)
NOSE_NECK_M = PLACE_M[MARKERS.index("nose"), 2]
LENS = lens_of(
    (3840, 2160), (2280.0, 2310.0), (1950.0, 1060.0), -0.05, 0.02, 3e-4, -2e-4, -0.003, height_above_water_m=2.4
)
CAMERA = CameraSpec(60.0, ROBOT.scale_length_m, LENS, Path("camera.toml"))


def filmed(place_m: np.ndarray, lens: CameraCalibration, frames: int = 40) -> tuple[np.ndarray, xr.Dataset]:
    """(n, m, 2) true places on the pool of a straight fish that swims about, y up, and its tracks."""
    rng = np.random.default_rng(3)
    heading = rng.uniform(0, 2 * np.pi, frames)
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]).transpose(2, 0, 1)
    centre = rng.uniform([-1.2, -0.6], [1.2, 0.6], (frames, 2))
    true = np.einsum("nij,mj->nmi", turn, place_m[:, :2]) + centre[:, None]
    depth = lens.height_above_water_m - (place_m[:, 2] - NOSE_NECK_M)  # (m,)
    ray = true * [1, -1] / depth[:, None]
    pixel = to_pixels(ray, lens)
    return true, as_tracks(MARKERS, np.arange(frames) / 60, pixel, np.ones(pixel.shape[:2]))


def distances(position_m: np.ndarray) -> np.ndarray:
    return np.linalg.norm(position_m[:, :, None] - position_m[:, None], axis=-1)


def error_mm(position_m: np.ndarray, true: np.ndarray) -> float:
    return float(1e3 * np.abs(distances(position_m) - distances(true)).max())


def test_distances_between_markers_at_their_heights_come_back() -> None:
    true, tracks = filmed(PLACE_M, LENS)
    position_m, scale = to_pool(tracks, CAMERA, marker_height_m=PLACE_M[:, 2])
    assert error_mm(position_m, true) < 0.1
    assert scale == pytest.approx(LENS.height_above_water_m / LENS.fx_px, rel=1e-9)


def test_without_heights_the_fins_are_displaced_by_parallax() -> None:
    true, tracks = filmed(PLACE_M, LENS)
    assert 5 < error_mm(to_pool(tracks, CAMERA)[0], true) < 100


def test_without_a_lens_pixels_are_scaled_and_nothing_else() -> None:
    _, tracks = filmed(PLACE_M, LENS)
    position_m, scale = to_pool(tracks, CameraSpec(60.0, ROBOT.scale_length_m), marker_height_m=PLACE_M[:, 2])
    assert np.array_equal(position_m, pixels_of(tracks) * np.array([scale, -scale]))


def test_a_camera_that_hangs_too_low_is_an_error_of_its_file() -> None:
    _, tracks = filmed(PLACE_M, LENS)
    low = CameraSpec(60.0, 0.142, LENS.model_copy(update={"height_above_water_m": 0.04}), Path("camera.toml"))
    with pytest.raises(InputError, match=r"camera\.toml: camera\.height_above_water_m: the lens is not above .* 0\.04"):
        to_pool(tracks, low, marker_height_m=PLACE_M[:, 2])


def test_no_scale_without_nose_and_neck() -> None:
    _, tracks = filmed(PLACE_M, LENS)
    pixels_of(tracks)[:, MARKERS.index("neck")] = np.nan
    with pytest.raises(NotEnoughData, match="have no scale"):
        to_pool(tracks, CAMERA)


def test_without_the_cameras_height_the_heights_change_nothing() -> None:
    _, tracks = filmed(PLACE_M, LENS)
    flat = CameraSpec(60.0, ROBOT.scale_length_m, LENS.model_copy(update={"height_above_water_m": None}))
    with_heights, _ = to_pool(tracks, flat, marker_height_m=PLACE_M[:, 2])
    assert np.array_equal(with_heights, to_pool(tracks, flat)[0])
