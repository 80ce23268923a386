"""The plan of a clip: everything that decides its pixels, validated when it is made."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from benchmarks.video.camera import Optics
from benchmarks.video.occlusion import Occlusion
from benchmarks.video.water import WaterLook
from session.create import FISHSIM_MARKERS
from session.toml_source import Table
from swimmer import RobotSpec, load_robot
from swimmer.robot import NonNegative, Positive

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
"""Of the markers by name, m: 14 to 27 px in the published videos."""

Gray = Annotated[float, Field(ge=0, le=255)]


class Swim(Table):
    """How the robot swims in a clip.

    Attributes:
        frequency_hz: turns of the twin's crank a second.
        pace: the simulated swim is shown so many times as fast.
        drift_m_s: mean velocity in the image, forward and to the robot's left; None keeps the twin's own.
        heading_deg: where the nose points, counter-clockwise from the right of the image.
        off_centre_px: of the middle of the swim, x to the right and y down.
    """

    frequency_hz: Positive = 1.0
    pace: Positive = 1.0
    drift_m_s: tuple[float, float] | None = None
    heading_deg: float = 180.0
    off_centre_px: tuple[float, float] = (0.0, 0.0)


class MarkerLook(Table):
    """How the markers look.

    Attributes:
        diameter_px: of every marker; None for the usual ones, scaled with the picture.
        gray: of the discs, 0 (black) to 255.
        base_gray: of the wider discs below them.
        body_gray: of the robot.
        glow: share by which the light on a marker comes and goes with the waves.
    """

    diameter_px: Positive | None = None
    gray: Gray = 236.0
    base_gray: Gray = 30.0
    body_gray: Gray = 42.0
    glow: Annotated[float, Field(ge=0, le=0.5)] = 0.04


class ClipPlan(Table):
    """A clip to be rendered.

    Attributes:
        frames: how many.
        seed: of every random draw.
        markers: the visible ones.
        swim: the motion.
        optics: the camera.
        marker_look: of the markers.
        water: the pool.
        glints_per_s: how many appear in a second.
        occlusions: poles over markers.
        skipped: frames that the camera dropped: the clock runs on, so the rate varies.
        robot: None for the built-in fish.
    """

    frames: Annotated[int, Field(ge=1)] = 240
    seed: Annotated[int, Field(ge=0)] = 0
    markers: tuple[str, ...] = FISHSIM_MARKERS
    swim: Swim = Swim()
    optics: Optics = Optics()
    marker_look: MarkerLook = MarkerLook()
    water: WaterLook = WaterLook()
    glints_per_s: NonNegative = 6.0
    occlusions: tuple[Occlusion, ...] = ()
    skipped: tuple[int, ...] = ()
    robot: RobotSpec | None = None

    @property
    def swimmer(self) -> RobotSpec:
        """The robot that swims."""
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
