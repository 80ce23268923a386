"""The plan of a clip: everything that decides its pixels, validated when it is made."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from benchmarks.video.camera import PX_PER_M, PoolCamera
from benchmarks.video.occlusion import Occlusion
from benchmarks.video.water import WaterLook
from session.camera import Distortion
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
_OTHER_DIAMETER_M = 0.02

Gray = Annotated[float, Field(ge=0, le=255)]


class Optics(Table):
    """The camera of a clip.

    Attributes:
        width_px, height_px: of the picture; multiples of 2 and 4.
        fps: frames a second.
        px_per_m: scale on the water.
        height_m: of the camera above the water; None for no parallax.
        distortion: k1, k2, p1, p2, k3 of OpenCV.
        readout_s: of the rolling shutter, from the first row to the last.
        exposure_s: of each row.
        blur_px: standard deviation of the lens' blur.
        noise: standard deviation of the sensor's noise, gray levels.
    """

    width_px: Annotated[int, Field(ge=32, multiple_of=2)] = 1280
    height_px: Annotated[int, Field(ge=32, multiple_of=4)] = 720
    fps: Positive = 60.0
    px_per_m: Positive = PX_PER_M
    height_m: Positive | None = 2.3
    distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
    readout_s: NonNegative = 0.0
    exposure_s: NonNegative = 1 / 240
    blur_px: Annotated[float, Field(ge=0.5, le=5)] = 0.8
    noise: NonNegative = 2.0

    @property
    def camera(self) -> PoolCamera:
        """The camera above the middle of the picture."""
        return PoolCamera.above(
            self.width_px, self.height_px, self.px_per_m, self.height_m, self.distortion, self.readout_s
        )


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


class Look(Table):
    """How a clip looks beside its markers.

    Attributes:
        water: the pool.
        glints_per_s: how many appear in a second.
        shadow: whether the robot casts one on the floor.
    """

    water: WaterLook = WaterLook()
    glints_per_s: NonNegative = 6.0
    shadow: bool = True


class ClipPlan(Table):
    """A clip to be rendered.

    Attributes:
        frames: how many.
        seed: of every random draw.
        markers: the visible ones.
        swim: the motion.
        optics: the camera.
        marker_look: of the markers.
        look: of all else.
        occlusions: poles over markers.
        skipped: frames that the camera dropped: the clock runs on, so the rate varies.
        robot: None for the built-in fish.

    Raises:
        pydantic.ValidationError: a `ValueError` that names every fault of the plan.
    """

    frames: Annotated[int, Field(ge=1)] = 240
    seed: Annotated[int, Field(ge=0)] = 0
    markers: tuple[str, ...] = FISHSIM_MARKERS
    swim: Swim = Swim()
    optics: Optics = Optics()
    marker_look: MarkerLook = MarkerLook()
    look: Look = Look()
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
        return self.optics.px_per_m * np.array([DIAMETER_M.get(name, _OTHER_DIAMETER_M) for name in self.markers])

    @model_validator(mode="after")
    def _fits_together(self) -> ClipPlan:
        if faults := [*_faults(self)]:
            raise ValueError("; ".join(faults))
        return self


def _faults(plan: ClipPlan) -> Iterator[str]:
    there = tuple(plan.swimmer.markers)
    for name in plan.markers:
        if name not in there:
            yield f"markers: found {name!r}, expected markers of {plan.swimmer.name}: {', '.join(there)}"
    if len(set(plan.markers)) < len(plan.markers) or not plan.markers:
        yield f"markers: found {', '.join(plan.markers) or 'none'}, expected at least one, each once"
    for occlusion in plan.occlusions:
        if occlusion.marker not in plan.markers:
            yield f"occlusions: found marker {occlusion.marker!r}, expected one of {', '.join(plan.markers)}"
        if (end := occlusion.first + occlusion.frames) > plan.frames:
            yield f"occlusions: found frame {end - 1}, expected frames 0 to {plan.frames - 1}"
    last = plan.frames + len(plan.skipped) - 1
    if len(set(plan.skipped)) < len(plan.skipped) or not all(0 < tick < last for tick in plan.skipped):
        yield f"skipped: found {plan.skipped}, expected numbers from 1 to {last - 1}, each once"
    if plan.optics.exposure_s > 1 / plan.optics.fps:
        yield f"optics.exposure_s: found {plan.optics.exposure_s:g} s, expected at most {1 / plan.optics.fps:g} s"
