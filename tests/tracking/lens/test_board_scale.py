"""The scale of the water's surface and the camera's height from a level board, at the surface, above and under it."""

import cv2
import numpy as np
import pytest

from swimcal.errors import NotEnoughData
from tests.tracking.lens.conftest import CHARUCO, LENS
from tests.tracking.lens.render import Scene, to_pixels
from tests.tracking.lens.test_parallax import H, slope_of
from tracking.board import Corners, find_corners, scale_from_board, scale_from_corners


def lying(height: float, turn: float = 0.4, tilt: float = 0.0) -> Corners:
    """The board enlarged to 2 m, level at a height above the water, seen from H above the water."""
    place = CHARUCO.corner_places_m * 8
    axes = cv2.Rodrigues(np.array([tilt, 0.0, 0.0]))[0] @ cv2.Rodrigues(np.array([0.0, 0.0, turn]))[0]
    point = (place - place.mean(axis=0)) @ axes.T + [0.3, -0.1, 0.0]
    if tilt:
        ray = point[:, :2] / (H + point[:, 2:])
    else:
        distance = np.linalg.norm(point[:, :2], axis=1)
        slope = np.array([slope_of(d, height) for d in distance])
        ray = point[:, :2] * (slope / distance)[:, None]
    return Corners(place, to_pixels(ray, LENS))


@pytest.mark.parametrize("height", [-0.6, 0.0, 0.15])
def test_scale_and_camera_height_come_back(height: float) -> None:
    found = scale_from_corners(lying(height), LENS, height)
    assert found.camera_height_m == pytest.approx(H, rel=1e-6)
    assert found.metres_per_px == pytest.approx(H / LENS.fx_px, rel=1e-6)
    assert found.rms_px < 1e-3


def test_the_stated_uncertainty_is_that_of_repeated_pictures() -> None:
    rng, clean = np.random.default_rng(0), lying(0.0)
    found = [
        scale_from_corners(clean._replace(image_px=clean.image_px + rng.normal(0, 0.3, clean.image_px.shape)), LENS)
        for _ in range(60)
    ]
    scatter = np.std([one.metres_per_px for one in found])
    assert scatter == pytest.approx(np.mean([one.sd_metres_per_px for one in found]), rel=0.3)


def test_a_tilted_camera_shows() -> None:
    found = scale_from_corners(lying(0.0, tilt=np.radians(4.0)), LENS)
    assert found.tilt_deg == pytest.approx(4.0, abs=0.01)
    assert found.rms_px > 1
    assert scale_from_corners(lying(0.0), LENS).tilt_deg == pytest.approx(0.0, abs=0.01)


def test_no_board_is_an_error(scene: Scene) -> None:
    blank = np.full((540, 960), 128, np.uint8)
    assert len(find_corners(blank, CHARUCO).image_px) == 0
    with pytest.raises(NotEnoughData, match="0 corners of the board were found; at least 4"):
        scale_from_board(blank, scene.board, LENS)
