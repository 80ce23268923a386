"""The camera of a session: its clock and scale, and the calibration of its lens where there is one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from session.toml_source import Table, load_toml

Positive = Annotated[float, Field(gt=0)]
Distortion = tuple[float, float, float, float, float]


class CameraCalibration(Table):
    """A pinhole camera with OpenCV's lens distortion (`calibrateCamera`), looking down on the pool.

    Focal lengths and principal point are in px, the centre of the top left pixel at (0, 0); `distortion` is k1, k2, p1,
    p2, k3. The height is that of the lens above the water; without it no parallax is assumed.
    """

    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    fx_px: Positive
    fy_px: Positive
    cx_px: float
    cy_px: float
    distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
    height_above_water_m: Positive | None = None


@dataclass(frozen=True)
class CameraSpec:
    """The camera of a session, as its `session.toml` states it.

    Attributes:
        fps: nominal frames a second; a video's own time stamps win over it.
        scale_length_m: distance from nose to neck, the length that gives the scale.
        calibration: calibration of the lens; None where it was not calibrated.
        file: the file that the calibration came from.
    """

    fps: float
    scale_length_m: float
    calibration: CameraCalibration | None = None
    file: Path | None = None


class _CameraFile(Table):
    camera: CameraCalibration


def load_camera(path: Path) -> CameraCalibration:
    """Read a camera file: one table ``[camera]`` with the keys of `CameraCalibration`.

    Raises:
        InputError: every fault of the file at once.
    """
    return load_toml(path, _CameraFile).camera
