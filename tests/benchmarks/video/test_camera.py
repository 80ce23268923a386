import numpy as np
import pytest

from benchmarks.video.camera import Optics
from swimcal.session_file import CameraCalibration
from tracking.camera import to_rays, true_over_apparent


def test_higher_points_move_away_from_the_middle_by_height_over_distance() -> None:
    camera = Optics(width_px=640, height_px=480, px_per_m=500, height_m=2.0)
    middle = np.array([319.5, 239.5])
    on_water, above = camera.project(np.array([[0.3, 0.2, 0.0], [0.3, 0.2, 0.1]]))

    np.testing.assert_allclose(on_water - middle, [150, -100])
    np.testing.assert_allclose(above - middle, (on_water - middle) * 2.0 / 1.9)
    assert camera.scale_at(np.array([0.0, 0.1])) == pytest.approx([500, 500 * 2.0 / 1.9])


def test_the_last_row_is_read_the_readout_after_the_first() -> None:
    camera = Optics(width_px=640, height_px=480, readout_s=0.01)

    np.testing.assert_allclose(camera.delay_s(np.array([0, 239.5, 479])), [-0.005, 0, 0.005])


def test_the_program_undoes_the_lens_and_the_parallax_it_is_filmed_with() -> None:
    """It undoes them with OpenCV, so the lens is OpenCV's."""
    distortion = (-0.2, 0.05, 0.001, -0.002, 0.01)
    camera = Optics(px_per_m=900, height_m=1.5, distortion=distortion)
    point_m = np.random.default_rng(1).uniform(-0.3, 0.3, (20, 3)) * [1, 1, 0] + [0, 0, 0.05]
    lens = CameraCalibration(
        width_px=1280, height_px=720, fx_px=1350.0, fy_px=1350.0, cx_px=639.5, cy_px=359.5, distortion=distortion
    )

    ray = to_rays(camera.project(point_m), lens)
    found_m = 1.5 * ray * true_over_apparent(ray, point_m[:, 2], 1.5)[:, None] * [1, -1]
    np.testing.assert_allclose(found_m, point_m[:, :2], atol=1e-6)
