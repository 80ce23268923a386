"""Plan of a clip: everything that decides its pixels, validated when it is made."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from benchmarks.video.camera import Optics
from benchmarks.video.occlusion import Occlusion
from benchmarks.video.water import WaterLook
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import NonNegative, Positive, RobotSpec, load_robot
from swimcal.toml import TomlTable

DIAMETER_M = {
    "nose": 0.028,
    "neck": 0.028,
    "pectoral_left": 0.026,
    "pectoral_right": 0.026,
    "dorsal_fin": 0.0155,
    "tail_1": 0.0155,
    "tail_2": 0.0155,
    "tail_3": 0.0155,
    "tail_4": 0.0148,
    "tail_5": 0.0148,
    "caudal_fin": 0.022,
}
"""Diameters of the markers by name, m: 14 to 27 px in the published videos."""

Gray = Annotated[float, Field(ge=0, le=255)]


class Swim(TomlTable):
    """Swim of the robot in a clip."""

    frequency_hz: Positive = 1.0  # turns of the twin's crank a second
    pace: Positive = 1.0  # factor on the speed at which the simulated swim is shown
    # mean velocity in the image, forward and to the robot's left; None keeps the twin's own
    drift_m_s: tuple[float, float] | None = None
    heading_deg: float = 180.0  # direction of the nose, counter-clockwise from the right of the image
    off_centre_px: tuple[float, float] = (0.0, 0.0)  # place of the middle of the swim, x to the right and y down


class MarkerLook(TomlTable):
    """Look of the markers."""

    diameter_px: Positive | None = None  # diameter of every marker; None for the usual ones, scaled with the picture
    gray: Gray = 236.0  # gray of the discs, 0 (black) to 255
    base_gray: Gray = 30.0  # gray of the wider discs below them
    body_gray: Gray = 42.0  # gray of the robot
    # share by which the light on a marker comes and goes with the waves
    glow: Annotated[float, Field(ge=0, le=0.5)] = 0.04


class ClipPlan(TomlTable):
    """Clip to be rendered."""

    frames: Annotated[int, Field(ge=1)] = 240  # number of frames
    seed: Annotated[int, Field(ge=0)] = 0  # seed of every random draw
    markers: tuple[str, ...] = FISHSIM_MARKERS  # visible markers
    swim: Swim = Swim()
    optics: Optics = Optics()
    marker_look: MarkerLook = MarkerLook()
    water: WaterLook = WaterLook()
    glints_per_s: NonNegative = 6.0  # number of glints that appear in a second
    occlusions: tuple[Occlusion, ...] = ()  # poles over markers
    skipped: tuple[int, ...] = ()  # frames that the camera dropped: the clock runs on, so the rate varies
    robot: RobotSpec | None = None  # None for the built-in fish

    @property
    def swimmer(self) -> RobotSpec:
        """Robot that swims."""
        return self.robot or load_robot()

    @property
    def time_s(self) -> np.ndarray:
        """(n,) time of each frame from the first, s."""
        ticks = np.setdiff1d(np.arange(self.frames + len(self.skipped)), self.skipped)
        return ticks / self.optics.fps

    @property
    def diameter_px(self) -> np.ndarray:
        """(m,) diameters of the markers, px on the water."""
        if self.marker_look.diameter_px is not None:
            return np.full(len(self.markers), self.marker_look.diameter_px)
        return self.optics.px_per_m * np.array([DIAMETER_M[name] for name in self.markers])
