"""Swims whose truth is known: of the twin without noise, and made by hand for what needs no twin."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from fitting import descent, search
from fitting.frequency import SwimFrequency
from fitting.measure_trial import measure_trial
from fitting.trial import MeasuredTrial, laid_on_pool
from swimcal.robot import load_robot
from swimcal.session import load_session
from swimcal.tracks import as_tracks, load_tracks
from swimsynth.disturbances import NOISELESS
from swimsynth.plan import SyntheticPlan, SyntheticTrial
from swimsynth.session import Truth, read_truth
from tracking.head_frame import HeadFrame, to_head_frame

PLAN = SyntheticPlan(
    trials=(
        SyntheticTrial(name="slow", frequency_hz=0.8, commanded_hz=0.82, seconds=3.5, phase_rad=1.0),
        SyntheticTrial(name="fast", frequency_hz=1.2, commanded_hz=1.25, seconds=3.0, phase_rad=4.0, heading_rad=2.0),
        SyntheticTrial(name="new", frequency_hz=1.0, commanded_hz=1.1, seconds=5.0, phase_rad=5.5, role="holdout"),
    ),
    noise=NOISELESS,
    run_in_s=4.0,
)

MARKERS = ("nose", "neck", "tail_4", "tail_5", "caudal_fin")


def noise_free(folder: Path) -> tuple[dict[str, MeasuredTrial], Truth]:
    """The trials of a session of `PLAN` as measured, by name, and their truth."""
    session = load_session(folder)
    trials = {}
    for spec in session.trials:
        assert spec.tracks is not None
        tracks = load_tracks(spec.tracks, session.markers, session.camera.fps)
        trials[spec.name] = measure_trial(spec, tracks, session.camera, load_robot(), session.warmup_s)
    return trials, read_truth(session.folder)


def filmed(
    markers: Sequence[str], time_s: np.ndarray, position_m: np.ndarray, head: HeadFrame, metres_per_px: float = 0.001
) -> xr.Dataset:
    """The tracks of markers at (n, m, 2) on the pool, every sample seen."""
    weight = np.ones(position_m.shape[:2])
    tracks = as_tracks(markers, time_s, position_m * [1, -1] / metres_per_px, weight)
    return laid_on_pool(tracks, position_m, head, weight, metres_per_px)


def by_hand(
    position_m: np.ndarray, fps: float = 10.0, markers: tuple[str, ...] = MARKERS, **changes: Any
) -> MeasuredTrial:
    """A fit trial of hand-made marker positions (n, m, 2), all samples good, no warm-up."""
    n, m = position_m.shape[:2]
    time_s, everything = np.arange(n) / fps, np.ones(n, bool)
    beat = SwimFrequency(1.0, 0.001, 0.0, 0.05, 1.0, float(time_s[-1]), 1.0)
    settings: dict[str, Any] = {
        "name": "hand",
        "role": "fit",
        "commanded_hz": 1.0,
        "tracks": filmed(markers[:m], time_s, position_m, to_head_frame(position_m, 0, 1)),
        "frequency": beat,
        "start_frequency": beat,
        "start_velocity": np.zeros(3),
        "known": everything,
        "kept": everything,
        "scored": everything,
        "speed": 0.0,
        "warmup_s": 0.0,
        "tail": (2, 3, 4),
        "flags": (),
    }
    return MeasuredTrial(**settings | changes)


def straight_swim(frames: int, speed: float = 0.1, fps: float = 10.0) -> np.ndarray:
    """(n, 5, 2) a stiff fish swimming towards -x, m."""
    shape = np.column_stack([[0.0, 0.142, 0.4, 0.45, 0.5], np.zeros(5)])
    path = np.zeros((frames, 1, 2))
    path[:, 0, 0] = -speed * np.arange(frames) / fps
    return shape + path


def head_frame_of(position_m: np.ndarray) -> HeadFrame:
    return to_head_frame(position_m, 0, 1)


def with_little_search(patch: pytest.MonkeyPatch) -> None:
    """A search of the coefficients that ends somewhere, for tests of what is made of its end."""
    for name, few in {"_SCREENED": 8, "_BEGUN": 1, "ROUNDS": 2, "_HOPS": 0, "_ALONG": 0}.items():
        patch.setattr(search, name, few)
    for name, few in {"ROUNDS": 2, "_REFINED": 0}.items():
        patch.setattr(descent, name, few)
