"""Small clips that need no simulation, and how the tests measure their pictures."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.video.camera import Optics
from benchmarks.video.motion import Motion
from benchmarks.video.plan import ClipPlan, MarkerLook
from benchmarks.video.scene import PoolScene
from benchmarks.video.stage import centred, staged
from benchmarks.video.water import WaterLook

HEAD = ("nose", "neck", "tail_3")


def small_scene(
    *, frequency_hz: float = 2.0, shift_m: tuple[float, float] = (0.0, 0.0), turn_rad: float = 0.0, **changes: Any
) -> PoolScene:
    """A clip of 6 frames, 320 x 240 px, of a waving robot without noise, on plain water."""
    optics: dict[str, Any] = {"width_px": 320, "height_px": 240, "px_per_m": 420.0, "noise": 0.0}
    settings: dict[str, Any] = {
        "frames": 6,
        "markers": HEAD,
        "marker_look": MarkerLook(diameter_px=16.0, glow=0.0),
        "water": WaterLook(ripple_mm=0.0, caustics=0.0, sheen=0.0),
        "glints_per_s": 0.0,
        "optics": Optics(**optics | changes.pop("optics", {})),
    }
    plan = ClipPlan(**settings | changes)
    motion = waving(len(plan.swimmer.hinges), frequency_hz, float(plan.time_s[-1])).moved(turn_rad, (0.0, 0.0))
    motion = centred(motion, plan.swimmer, plan.markers, plan.time_s).moved(0.0, shift_m)
    return PoolScene(plan, staged(motion, plan.swimmer, plan.markers, plan.optics, plan.time_s))


def waving(hinges: int, frequency_hz: float, seconds: float) -> Motion:
    """A wave that runs down the hinges of a robot whose head stays at the origin."""
    time_s = np.arange(-0.1, seconds + 0.11, 1 / 240)
    lag = np.linspace(0.0, np.pi, hinges)
    return Motion(time_s, np.zeros((len(time_s), 3)), 0.3 * np.sin(2 * np.pi * frequency_hz * time_s[:, None] - lag))


def centroid_px(weights: np.ndarray, near_px: np.ndarray, reach: int = 20) -> np.ndarray:
    """(x, y) centre of gravity of weights (h, w) around a place."""
    left, top = np.maximum(np.round(near_px).astype(int) - reach, 0)
    weight = weights[top : top + 2 * reach + 1, left : left + 2 * reach + 1]
    y, x = np.indices(weight.shape)
    return np.array([left + np.sum(weight * x) / np.sum(weight), top + np.sum(weight * y) / np.sum(weight)])
