"""Tracks of a made-up fish with a travelling wave along its tail, and faults to put into them."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr

from swimcal.robot import RobotSpec, load_robot
from swimcal.tracks import as_tracks

ROBOT = load_robot()
MARKERS = ("nose", "neck", "dorsal_fin", "tail_1", "tail_2", "tail_3", "tail_4", "tail_5", "caudal_fin")
PX_PER_M = 950.0
FPS = 60.0


def tracks_of(position_px: np.ndarray, markers: Sequence[str] = MARKERS) -> xr.Dataset:
    present = np.isfinite(position_px).all(axis=2)
    return as_tracks(tuple(markers), np.arange(len(position_px)) / FPS, position_px, present.astype(float))


def swimming_fish(
    hz: float, seed: int, *, frames: int = 300, markers: Sequence[str] = MARKERS, robot: RobotSpec = ROBOT
) -> np.ndarray:
    """(n, m, 2) boxes as in the public tracks: placed by hand, correlated noise, half pixels, y down, px."""
    rng = np.random.default_rng(seed)
    place_m = robot.marker_positions_m(tuple(markers))
    tail = np.array([robot.markers[name].body != "head" for name in markers])
    place_px = place_m[:, :2] * PX_PER_M + rng.normal(0, 2.5, (len(markers), 2))
    time_s = np.arange(frames) / FPS
    phase = 2 * np.pi * (hz * time_s + rng.random())

    root_px = place_px[~tail, 0].max()
    along = np.linspace(0, max(place_px[:, 0].max() - root_px, 1.0), 200)  # (s,) px
    bend = rng.uniform(0.45, 0.8) * (0.15 + 0.85 * along / along[-1])
    angle = bend * np.sin(phase[:, None] - rng.uniform(0.003, 0.012) * along)  # (n, s)
    step = along[1] - along[0]
    reach, sway = np.cumsum(np.cos(angle), axis=1) * step, np.cumsum(np.sin(angle), axis=1) * step
    at = np.searchsorted(along, np.maximum(place_px[:, 0] - root_px, 0.0)).clip(0, len(along) - 1)
    x = np.where(tail, root_px + reach[:, at], place_px[:, 0])  # (n, m)
    y = np.where(tail, sway[:, at], 0.0) + place_px[:, 1]

    yaw = 0.06 * np.sin(phase + 2) + rng.uniform(-0.04, 0.04) * time_s + rng.uniform(0, 2 * np.pi)
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    swum = rng.uniform(20, 80) * time_s[:, None]
    position = np.stack([cos * (x - swum) - sin * y, sin * (x - swum) + cos * y], axis=-1)
    higher = (place_m[:, 2] - 0.05)[:, None] / 1.5  # share of the camera's height: seen further from the middle
    position += higher * (position + np.array([200.0, 150.0])) + np.array([2000.0, 1100.0])
    return _as_boxes(position, rng) * [1.0, -1.0]


def _as_boxes(position: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    noise = rng.normal(0, 0.5, position.shape)
    for earlier, now in pairwise(noise):
        now += 0.7 * earlier
    return np.round(2 * (position + noise)) / 2


class Faulty(NamedTuple):
    """Tracks with a fault: position_px (n, m, 2), and the samples (n, m) that it concerns."""

    position_px: np.ndarray
    touched: np.ndarray


def with_fault(kind: str, clean_px: np.ndarray, k: int, rng: np.random.Generator) -> Faulty:
    """One fault of marker k, at a random time and of a random size, markers in body order."""
    n, m, _ = clean_px.shape
    long = int(rng.integers(1, 4) if kind == "jump" else rng.integers(8, 60))
    first = int(rng.integers(5, n - long - 5))
    span = slice(first, first + long)
    other = k + 1 if k == 0 or (k < m - 1 and rng.random() < 0.5) else k - 1
    position, touched = clean_px.copy(), np.zeros((n, m), dtype=bool)
    touched[span, k] = True
    if kind == "merge":
        position[span, k] = clean_px[span, other] + np.round(rng.normal(0, 2, 2) + rng.normal(0, 0.5, (long, 2)))
    elif kind == "freeze":
        position[span, k] = clean_px[first - 1, k]
    elif kind == "swap":
        position[span, [k, other]] = clean_px[span, [other, k]]
        touched[span, other] = True
    else:
        direction = rng.uniform(0, 2 * np.pi)
        position[span, k] += np.round(rng.uniform(9, 30) * np.array([np.cos(direction), np.sin(direction)]))
    return Faulty(position, touched)
