"""What is doubtful about a camera is said, with its likely size."""

from pathlib import Path

import numpy as np
import pytest

from swimcal.session_file import CameraCalibration, CameraSpec, load_camera
from swimcal.tracks import as_tracks
from tests.tracking.lens.conftest import LENS
from tracking.camera import lens_flags, to_rays
from tracking.lens import save_camera

NOTHING_SEEN = as_tracks(("nose", "neck"), np.arange(9.0), np.full((9, 2, 2), np.nan), np.zeros((9, 2)))
KNOWN = LENS.model_copy(update={"height_above_water_m": 2.0})


def kinds(camera: CameraSpec, picture_px: tuple[int, int] | None = None, scale: float | None = None) -> set[str]:
    return {flag.kind for flag in lens_flags(camera, NOTHING_SEEN, picture_px, scale)}


def test_a_missing_lens_is_flagged_with_its_size() -> None:
    (flag,) = lens_flags(CameraSpec(60.0, 0.142), NOTHING_SEEN)
    assert flag.kind == "no_lens"
    assert "0.9 % of the picture's width" in flag.message
    assert "lengths there by 5 %" in flag.message


def test_the_stated_size_is_that_of_such_a_lens() -> None:
    lens = LENS.model_copy(update={"fx_px": 500.0, "fy_px": 500.0, "distortion": (0.02, 0.0, 0.0, 0.0, 0.0)})
    slope = np.array([[0.96, 0.0], [0.961, 0.0]])
    pixel = slope * (1 + 0.02 * slope[:, :1] ** 2) * 500 + [491, 263]
    assert to_rays(pixel, lens) == pytest.approx(slope)
    assert (pixel[0, 0] - (0.96 * 500 + 491)) / 960 == pytest.approx(0.009, rel=0.05)
    assert (pixel[1, 0] - pixel[0, 0]) / 0.5 - 1 == pytest.approx(0.055, rel=0.05)


def test_other_flags_are_separated() -> None:
    assert kinds(CameraSpec(60.0, 0.142, LENS)) == {"no_camera_height"}
    assert kinds(CameraSpec(60.0, 0.142, KNOWN), picture_px=(1920, 1080)) == {"lens_other_size"}
    assert kinds(CameraSpec(60.0, 0.142, KNOWN), scale=2.3 / KNOWN.fx_px) == {"camera_height_off_scale"}
    folded = KNOWN.model_copy(update={"distortion": (-2.0, 0.0, 0.0, 0.0, 0.0)})
    assert kinds(CameraSpec(60.0, 0.142, folded)) == {"lens_folds"}


@pytest.mark.parametrize("height", [None, 2.4])
def test_what_is_written_is_read_back(tmp_path: Path, height: float | None) -> None:
    lens: CameraCalibration = LENS.model_copy(update={"height_above_water_m": height, "fx_px": 1e3 / 3, "fy_px": 1e5})
    save_camera(tmp_path / "camera.toml", lens)
    assert load_camera(tmp_path / "camera.toml") == lens
    assert ("height_above_water_m" in (tmp_path / "camera.toml").read_text()) == (height is not None)
