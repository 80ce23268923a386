"""Free decays whose truth is known: made with a step an eighth of the fit's, filmed with tracking errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import xarray as xr

from fitting.hinges import DecayTwin
from swimcal.mjcf import FREE_DECAY
from swimcal.robot import load_robot
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from swimsynth.disturbances import TrackingNoise, lasting_errors, on_grid, placement_offsets

ROBOT = load_robot()
CAMERA = CameraSpec(fps=60.0, scale_length_m=0.142)
MARKERS = ("nose", "neck", "dorsal_fin", "tail_1", "tail_2", "tail_3", "tail_4", "tail_5", "caudal_fin")
PX_PER_M = 950.0
BENT = (0.22, 0.25, 0.25, 0.2, 0.1)  # angles of the hinges, rad
NOISE = TrackingNoise()


@dataclass(frozen=True)
class Truth:
    """Of one decay: hinges, pose in which it is let go, and when after the start of the recording."""

    stiffness_n_m: float = 0.65
    damping_n_m_s: float = 0.02
    bent_rad: tuple[float, ...] = BENT
    release_s: float = 0.507
    seconds: float = 2.0
    fps: float = 60.0


@lru_cache(maxsize=4)
def fine_twin(step_s: float = 0.0004) -> DecayTwin:
    return DecayTwin(ROBOT, MARKERS, replace(FREE_DECAY, timestep_s=step_s), workers=1)


def swings(truths: list[Truth], step_s: float = 0.0004) -> np.ndarray:
    """(s, n, m, 2) marker places in the robot frame of decays of one length and frame rate, m."""
    moving = [np.maximum(frame_times(truth) - truth.release_s, 0.0) for truth in truths]
    together = np.unique(np.concatenate(moving))
    start = np.zeros((len(truths), 2, 5))
    start[:, 0] = [truth.bent_rad for truth in truths]
    stiffness, damping = np.array([(t.stiffness_n_m, t.damping_n_m_s) for t in truths]).T
    place = fine_twin(step_s)(stiffness, damping, start, together)
    return np.stack([one[np.searchsorted(together, at)] for one, at in zip(place, moving, strict=True)])


def frame_times(truth: Truth) -> np.ndarray:
    return np.arange(round(truth.seconds * truth.fps)) / truth.fps


def filmed(
    place_m: np.ndarray, truth: Truth, seed: int = 0, noise: TrackingNoise = NOISE, heading_rad: float = 0.4
) -> xr.Dataset:
    """Tracks (n, m) of marker places (n, m, 2), with errors that last, boxes off their markers, half pixels."""
    random = np.random.default_rng(seed)
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    seen = place_m @ np.array([[cos, sin], [-sin, cos]]) * PX_PER_M * [1.0, -1.0] + [900.0, 700.0]
    seen = seen + placement_offsets(len(MARKERS), noise, random)
    seen = seen + lasting_errors(seen.shape, 1 / truth.fps, noise, random)
    return as_tracks(MARKERS, frame_times(truth), on_grid(seen, noise), np.ones(seen.shape[:2]))


def decay_tracks(truth: Truth | None = None, seed: int = 0, noise: TrackingNoise = NOISE) -> xr.Dataset:
    truth = truth or Truth()
    return filmed(swings([truth])[0], truth, seed, noise)
