"""A camera file holds what was written, to the last digit."""

from pathlib import Path

import pytest

from session.camera import CameraCalibration, load_camera
from tests.tracking.lens.conftest import LENS
from tracking.lens import save_camera


@pytest.mark.parametrize("height", [None, 2.4])
def test_what_is_written_is_read_back(tmp_path: Path, height: float | None) -> None:
    lens: CameraCalibration = LENS.model_copy(update={"height_above_water_m": height, "fx_px": 1e3 / 3, "fy_px": 1e5})
    save_camera(tmp_path / "camera.toml", lens)
    assert load_camera(tmp_path / "camera.toml") == lens
    assert ("height_above_water_m" in (tmp_path / "camera.toml").read_text()) == (height is not None)
