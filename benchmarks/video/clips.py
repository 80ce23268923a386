"""Named clips that a tracker is measured with: one difficulty each, about a swim at the public motion or faster.

All but the last are 1280 x 720 px, the part of a 4K picture around the robot, so markers have their size of 4K.
"""

from __future__ import annotations

from typing import Any

from benchmarks.video.camera import PX_PER_M, Optics
from benchmarks.video.occlusion import Occlusion
from benchmarks.video.plan import ClipPlan, MarkerLook, Swim
from benchmarks.video.water import WaterLook
from swimcal.robot import RobotSpec, load_robot

FASTEST_PUBLIC_HZ = 1.75
"""Crank turns a second of the fastest public trial, whose markers move up to 10 px a frame."""
DORSAL_M = 0.253
"""Place of the dorsal fin's marker in the public videos: 40 to 55 px before tail_1, not 19 as in the description."""
_TAIL_M = 0.021  # distance between tail_4 and tail_5, the closest neighbours
_HOVER_M_S = (0.03, 0.0)  # With this mean velocity the swim stays in the picture.


def clip_robot() -> RobotSpec:
    """Return the built-in fish with the dorsal fin's marker where the public videos show it."""
    robot = load_robot()
    dorsal = robot.markers["dorsal_fin"]
    _, y, z = dorsal.position_m
    moved = dorsal.model_copy(update={"position_m": (DORSAL_M, y, z)})
    return robot.model_copy(update={"markers": robot.markers | {"dorsal_fin": moved}})


def _plan(
    frequency_hz: float = FASTEST_PUBLIC_HZ,
    *,
    swim: dict[str, Any] | None = None,
    optics: dict[str, Any] | None = None,
    **others: Any,
) -> ClipPlan:
    swimming: dict[str, Any] = {"frequency_hz": frequency_hz, "drift_m_s": _HOVER_M_S, "heading_deg": 172.0} | (
        swim or {}
    )
    settings: dict[str, Any] = {
        "robot": clip_robot(),
        "swim": Swim(**swimming),
        "optics": Optics(**optics or {}),
    }
    return ClipPlan(**settings | others)


def _space_markers(pixels: float) -> dict[str, Any]:
    """Return optics whose closest neighbours are so many px apart."""
    return {"px_per_m": pixels / _TAIL_M}


BENCHMARK_CLIPS: dict[str, ClipPlan] = {
    "slow": _plan(0.6, seed=1),
    "clean_2_25hz": _plan(
        2.25,
        optics=_space_markers(18.65),  # 18.0 where the tail bends most
        seed=2,
        marker_look=MarkerLook(diameter_px=14.0),
        glints_per_s=0.0,
        water=WaterLook(ripple_mm=1.0),
    ),
    "motion_2x": _plan(swim={"pace": 2.0}, seed=3),
    "motion_3x": _plan(swim={"pace": 3.0}, seed=4),
    "neighbours_14px": _plan(optics=_space_markers(14.4), seed=5, marker_look=MarkerLook(diameter_px=11.0)),
    "occlusion_15": _plan(occlusions=(Occlusion(marker="tail_2", first=100, frames=15),), seed=6),
    "leaves_picture": _plan(1.0, swim={"drift_m_s": (0.09, 0.0), "off_centre_px": (-370.0, 60.0)}, seed=7),
    "comes_and_goes": _plan(swim={"heading_deg": 188.0, "off_centre_px": (0.0, -270.0)}, seed=16),
    "glints": _plan(glints_per_s=45.0, seed=8),
    "ripple": _plan(water=WaterLook(ripple_mm=5.0, caustics=0.6, sheen=45.0), marker_look=MarkerLook(glow=0.2), seed=9),
    "blur": _plan(2.25, optics={"exposure_s": 1 / 66}, seed=10),
    "dark_markers": _plan(marker_look=MarkerLook(gray=24, base_gray=225, body_gray=170), seed=11),
    "low_contrast": _plan(marker_look=MarkerLook(gray=118, base_gray=66, body_gray=60), optics={"noise": 4.0}, seed=12),
    "lens": _plan(optics={"distortion": (-0.12, 0.03, 0.0, 0.0, 0.0), "readout_s": 0.012, "height_m": 1.2}, seed=13),
    "variable_rate": _plan(skipped=(40, 41, 97, 150), seed=14),
    "speed_4k": _plan(
        frames=600,
        seed=15,
        optics={"width_px": 3840, "height_px": 2160, "px_per_m": PX_PER_M},
        swim={"drift_m_s": (0.1, 0.02)},
        markers=tuple(load_robot().markers),
    ),
}
"""Plans of clips by name. They have 240 frames at 60 a second, `speed_4k` 600 with all 11 markers.

In `leaves_picture` the nose leaves for good, in `comes_and_goes` the tail's end with each beat. `clean_2_25hz` has
neighbours at 18 px and no glints; `neighbours_14px` is smaller, and so are its markers, which could not be so close.
"""
