"""Tracked trials for the tests: twin motion, noise, and any mixture of states."""

from functools import cache

import numpy as np
import xarray as xr

from swimcal.flags import Flag
from swimcal.robot import load_robot
from swimcal.runs import Runs
from swimcal.tracks import as_tracks, markers_of, pixels_of
from swimcal.twin import Twin
from tests.tracking.fish import FPS, MARKERS, PX_PER_M
from tracking.tracked import SampleState, as_tracked, with_states

HZ = (1.0, 1.75, 2.25)


@cache
def twin_px() -> np.ndarray:
    """(3, n, m, 2) the twin's swims at `HZ`, four seconds after one to start, px."""
    coefficients = np.tile([0.5, 0.25, 1.5, 1.0, 1.0], (len(HZ), 1))
    runs = Runs(coefficients, np.array(HZ), np.zeros(len(HZ)))
    seen = Twin(load_robot(), MARKERS, workers=1).simulate(runs, np.arange(5 * int(FPS)) / FPS)
    return seen.marker_m[:, int(FPS) :, :, :2] * PX_PER_M


def tracked_of(position_px: np.ndarray, markers: tuple[str, ...] = MARKERS) -> xr.Dataset:
    """Measured wherever there is a position."""
    present = np.isfinite(position_px).all(axis=2)
    time_s = np.arange(len(position_px)) / FPS
    return as_tracked(as_tracks(markers, time_s, position_px, present.astype(float)))


def mixed_trial(seed: int, frames: int = 12, markers: tuple[str, ...] = ("nose", "neck", "tail_1")) -> xr.Dataset:
    """Any states, any numbers; every marker has at least one sample."""
    rng = np.random.default_rng(seed)
    shape = (frames, len(markers))
    state = rng.integers(0, len(SampleState), shape).astype(np.int8)
    state[0] = SampleState.MEASURED
    missing = state == SampleState.MISSING
    position = np.where(missing[..., None], np.nan, rng.normal(500, 200, (*shape, 2)))
    size = np.where(state == SampleState.MEASURED, rng.uniform(10, 30, shape), np.nan)
    time_s = np.cumsum(rng.uniform(0.01, 0.03, frames))
    confidence = np.where(missing, 0.0, rng.random(shape))
    flags = (Flag("jump", ("nose",), (3, 4), "nose jümps"), Flag("not_converged", (), None, ""))
    return with_states(as_tracks(markers, time_s, position, confidence), state, size, flags)


def same(one: xr.Dataset, other: xr.Dataset, *, flags: bool = True) -> bool:
    """Whether two trials are alike bit for bit."""
    arrays = [
        (trial.time.values, pixels_of(trial), trial.confidence.values, trial.state.values, trial["size"].values)
        for trial in (one, other)
    ]
    alike = all(np.array_equal(a, b, equal_nan=True) for a, b in zip(*arrays, strict=True))
    return alike and markers_of(one) == markers_of(other) and (not flags or one.flags == other.flags)
