"""Swims of the twin itself: frequency and start are known exactly, coefficients and crank phases are sought."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.frequency import SwimFrequency
from fitting.pool import forward_speed, tail_markers
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.mjcf import DRY, FluidCoefficients
from swimcal.robot import RobotSpec, load_robot
from swimcal.runs import Runs
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.swims import by_hand

FPS, WARMUP_S = 60.0, 1.0
HZ = (0.6, 1.0, 1.4)
PHASES = 2 * np.pi * np.random.default_rng(1).random(len(HZ))
ROBOT = load_robot()


def exact_twin(workers: int = 0) -> Twin:
    return Twin(ROBOT, FISHSIM_MARKERS, workers=workers)


def exact_swims(
    coefficients: FluidCoefficients = PLAUSIBLE_COEFFICIENTS,
    hz: Sequence[float] = HZ,
    seconds: float = 5.0,
    noise_m: float = 0.0,
    seed: int = 0,
    lasts_s: float = 1 / 3,
    robot: RobotSpec = ROBOT,
) -> tuple[MeasuredTrial, ...]:
    """Fit trials at some frequencies, from a forward start of 0.1 m/s.

    Args:
        coefficients: the truth.
        hz: turns of the crank a second, one trial each.
        seconds: of each trial.
        noise_m: standard deviation of tracking noise; of two that differ in sign alone one is the other's mirror image.
        seed: of the noise.
        lasts_s: of the noise in each marker.
        robot: the robot that swims; the trials are measured as of the built-in one.
    """
    random = np.random.default_rng(seed)
    time_s = np.arange(round(seconds * FPS) + 1) / FPS
    runs = Runs(
        coefficients=np.tile(coefficients, (len(hz), 1)).astype(float),
        frequency_hz=np.array(hz, float),
        phase_rad=2 * np.pi * np.random.default_rng(1).random(len(hz)),
        velocity=np.tile([-0.1, 0.0, 0.0], (len(hz), 1)),
    )
    twin = Twin(robot, FISHSIM_MARKERS)
    marker_m = twin.simulate(runs, time_s).marker_m
    noisy = marker_m + noise_m * lasting_noise(marker_m.shape, random, lasts_s)
    return tuple(measured_swim(f"f{f:.2f}", f, positions) for f, positions in zip(hz, noisy, strict=True))


def exact_dry_run(hz: float = 1.0, seconds: float = 5.0, noise_m: float = 0.0, seed: int = 0) -> MeasuredTrial:
    """The same robot with its head clamped in air."""
    time_s = np.arange(round(seconds * FPS) + 1) / FPS
    runs = Runs(np.array([PLAUSIBLE_COEFFICIENTS], float), np.array([hz]), np.zeros(1))
    marker_m = Twin(ROBOT, FISHSIM_MARKERS, DRY, 1).simulate(runs, time_s).marker_m
    noise = noise_m * lasting_noise(marker_m.shape, np.random.default_rng(seed), 1 / 3)
    return measured_swim(f"dry{hz:.2f}", hz, (marker_m + noise)[0])


def lasting_noise(shape: tuple[int, ...], random: np.random.Generator, lasts_s: float) -> np.ndarray:
    """(t, n, m, 2) AR(1) noise of standard deviation 1 that lasts so long."""
    keep = np.exp(-1 / (lasts_s * FPS))
    fresh = random.normal(size=shape)
    fresh[:, 1:] *= np.sqrt(1 - keep**2)
    for frame in range(1, shape[1]):
        fresh[:, frame] += keep * fresh[:, frame - 1]
    return fresh


def measured_swim(name: str, hz: float, position_m: np.ndarray) -> MeasuredTrial:
    n = len(position_m)
    time_s = np.arange(n) / FPS
    beat = SwimFrequency(hz, 1e-3, 0.0, 0.05, 1.0, float(time_s[-1]), 1.0)
    kept = time_s >= WARMUP_S - 1e-9
    trial = by_hand(
        position_m,
        fps=FPS,
        name=name,
        commanded_hz=hz,
        markers=FISHSIM_MARKERS,
        frequency=beat,
        start_frequency=beat,
        start_velocity=np.array([-0.1, 0.0, 0.0]),
        kept=kept,
        scored=kept & (time_s < WARMUP_S + 4.0 - 1e-9),
        warmup_s=WARMUP_S,
        tail=tuple(tail_markers(ROBOT, FISHSIM_MARKERS)),
    )
    speed = float(forward_speed(time_s, trial.head, kept, hz))
    return replace(trial, speed=speed)
