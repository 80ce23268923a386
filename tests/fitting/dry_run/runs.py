"""Dry runs whose truth is known: of a finer twin with tracking noise, and their tables, made once."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import xarray as xr

from fitting.dry_run import DryResponse, DryTrial, measure_dry_run, simulate_response, with_arm
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.mjcf import DRY
from swimcal.robot import RobotSpec, load_robot
from swimcal.runs import Runs
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from swimcal.twin import Twin
from swimsynth.disturbances import NOISELESS, TrackingNoise, lasting_errors, on_grid, placement_offsets

CAMERA = CameraSpec(fps=60.0, scale_length_m=0.142, calibration=None, file=None)
FINE_S = 0.0005  # a third of the step that the tables are made with
PX_PER_M = 965.0
ROBOT = load_robot()
NOISE = TrackingNoise()


@lru_cache(maxsize=32)
def clean_run(arm_m: float, hz: float, phase_rad: float, seconds: float = 5.0) -> tuple[np.ndarray, np.ndarray, float]:
    """Times (n,), markers (n, m, 2) in the pool, m, and the crank's mean speed, Hz; it has turned for a turn before."""
    twin = Twin(with_arm(ROBOT, arm_m), FISHSIM_MARKERS, replace(DRY, timestep_s=FINE_S))
    time_s, before = np.arange(round(60 * seconds) + 1) / 60.0, 1.0 / hz
    runs = Runs(np.zeros((1, 5)), np.array([hz]), np.array([phase_rad]))
    seen = twin.simulate(runs, time_s + before)
    crank = seen.crank_rad[0]
    return time_s, seen.marker_m[0], float((crank[-1] - crank[0]) / (2 * np.pi * time_s[-1]))


def tracks_of(
    arm_m: float, hz: float, phase_rad: float, seed: int, noise: TrackingNoise = NOISE, seconds: float = 5.0
) -> xr.Dataset:
    """What a tracker finds: the fish lies askew in the picture."""
    time_s, marker_m, _ = clean_run(arm_m, hz, phase_rad, seconds)
    turn = np.exp(0.4j)
    place = (marker_m[..., 0] + 1j * marker_m[..., 1]) * turn * PX_PER_M
    place_px = np.stack([place.real + 900.0, 1000.0 - place.imag], axis=-1)
    random = np.random.default_rng(seed)
    place_px = place_px + placement_offsets(place_px.shape[1], noise, random)
    place_px = on_grid(place_px + lasting_errors(place_px.shape, 1 / 60.0, noise, random), noise)
    return as_tracks(FISHSIM_MARKERS, time_s, place_px, np.ones(place_px.shape[:2]))


def dry_trial(
    arm_m: float = 0.0382,
    hz: float = 0.6,
    phase_rad: float = 1.0,
    seed: int = 0,
    noise: TrackingNoise = NOISE,
    seconds: float = 5.0,
    commanded_hz: float | None = None,
    robot: RobotSpec = ROBOT,
) -> DryTrial:
    """A measured dry run; its command is 3 % above its speed unless reported."""
    spec = TrialSpec(f"dry_{hz:g}", "dry", commanded_hz=commanded_hz or 1.03 * hz)
    return measure_dry_run(spec, tracks_of(arm_m, hz, phase_rad, seed, noise, seconds), CAMERA, robot)


@lru_cache(maxsize=1)
def shared_response() -> DryResponse:
    """The tables of the built-in robot for both published speeds."""
    arms = np.linspace(0.75, 1.25, 21) * ROBOT.crank.arm_m
    return simulate_response(ROBOT, FISHSIM_MARKERS, arms, (0.5, 1.45))


__all__ = ["CAMERA", "NOISELESS", "ROBOT", "clean_run", "dry_trial", "shared_response", "tracks_of"]
