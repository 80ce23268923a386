"""The fit reaches the optimum, takes no more coefficients than the corners support, and knows its uncertainty."""

from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from swimcal.session_file import CameraCalibration
from tests.tracking.lens.conftest import CHARUCO, LENS
from tests.tracking.lens.render import Scene, poses, to_pixels
from tracking.board import Corners
from tracking.lens import fit_lens, lens_covariance

NOISE_PX = 0.05
TRUTH = np.array([LENS.fx_px, LENS.fy_px, LENS.cx_px, LENS.cy_px, *LENS.distortion])


def seen_by(lens: CameraCalibration, views: Sequence[np.ndarray], rng: np.random.Generator) -> list[Corners]:
    """Corners as projected, with independent errors."""
    found = []
    for pose in views:
        point = CHARUCO.corner_places_m @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]
        pixel = to_pixels(point[:, :2] / point[:, 2:], lens) + rng.normal(0, NOISE_PX, (len(point), 2))
        inside = ((pixel >= 0) & (pixel < [lens.width_px, lens.height_px])).all(axis=1)
        found.append(Corners(CHARUCO.corner_places_m[inside], pixel[inside]))
    return found


@pytest.mark.long
def test_stated_standard_deviations_are_those_of_repeated_calibrations() -> None:
    rng, scatter = np.random.default_rng(5), []
    views = poses(Scene(LENS, CHARUCO), 9, rng)
    for _ in range(20):
        fit = fit_lens(seen_by(LENS, views, rng), LENS.width_px, LENS.height_px)
        assert fit.model == "k1 k2 p1 p2 k3"
        scatter.append((fit.bundle.lens - TRUTH) / np.sqrt(np.diag(lens_covariance(fit))))
    rms = np.sqrt(np.mean(np.square(scatter), axis=0))  # (9,)
    assert rms == pytest.approx(np.ones(9), abs=0.45)  # 20 draws: 1 +- 0.16 each
    assert rms.mean() == pytest.approx(1.0, abs=0.2)


def test_a_plain_lens_gets_a_plain_model() -> None:
    plain = LENS.model_copy(update={"distortion": (-0.1, 0.0, 0.0, 0.0, 0.0)})
    rng = np.random.default_rng(8)
    fit = fit_lens(seen_by(plain, poses(Scene(plain, CHARUCO), 12, rng), rng), LENS.width_px, LENS.height_px)
    assert fit.model == "k1"
    assert fit.bundle.lens[4] == pytest.approx(-0.1, abs=1e-3)
    assert (fit.bundle.lens[5:] == 0).all()


def test_level_views_do_not_determine_the_focal_length() -> None:
    rng = np.random.default_rng(9)
    level = [np.array([0, 0, turn, -0.1, -0.08, 0.3]) for turn in (0.0, 0.3, 0.6)]
    fit = fit_lens(seen_by(LENS, level, rng), LENS.width_px, LENS.height_px)
    assert np.sqrt(lens_covariance(fit)[0, 0]) > 0.01 * LENS.fx_px
