"""Filmed drives of the motor whose clock is known: the synthetic motor, the twin's tail, and a tracker's errors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from fitting.motor_clock import MotorRecord, motor_record
from fitting.motor_code import LateralMotion
from fitting.pool import tail_markers
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.mjcf import DRY, SWIM
from swimcal.motor_log import MotorCommands, MotorLog
from swimcal.robot import load_robot
from swimcal.runs import Runs
from swimcal.session import TrialSpec
from swimcal.twin import Twin
from swimsynth.disturbances import SyntheticMotor, TrackingNoise, drive, lasting_errors
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from swimsynth.simulate import read_motor, reading_times
from tracking.head_frame import to_head_frame

FPS, HZ, PX_PER_M = 60.0, 0.9, 965.0
NOISE = TrackingNoise()
SPEC = TrialSpec("f0_90", "dry", commanded_hz=HZ)
SWIM_SPEC = replace(SPEC, kind="swim")
ROBOT = load_robot()


class Filmed(NamedTuple):
    """A drive: its true clock, what was logged and commanded, where the markers are (n, m, 2), m, and the trial."""

    motor: SyntheticMotor
    log: MotorLog
    commands: MotorCommands
    time_s: np.ndarray
    marker_m: np.ndarray
    spec: TrialSpec

    def offset_at(self, video_s: float) -> float:
        """Motor clock minus video clock, s."""
        return float(self.motor.clock(video_s)) - video_s


@cache
def filmed(count: int, in_water: bool = False, seed: int = 0) -> tuple[Filmed, ...]:
    """Some drives that start anywhere in the turn of the crank and whose clocks differ."""
    random = np.random.default_rng(seed)
    motors = [
        SyntheticMotor(
            starts_s=0.6 + random.random(),
            clock_offset_s=1e4 * random.random(),
            clock_rate=1 + 5e-5 * random.normal(),
        )
        for _ in range(count)
    ]
    drives = [drive(motor, HZ, 0.99 * HZ, 2 * np.pi * random.random(), random) for motor in motors]
    turns = tuple(one.turn.shifted(m.clock_offset_s, m.clock_rate) for one, m in zip(drives, motors, strict=True))
    time_s = np.arange(0, max(motor.ends_s for motor in motors) + 0.4, 1 / FPS)
    runs = Runs(
        coefficients=np.tile(PLAUSIBLE_COEFFICIENTS, (count, 1)).astype(float),
        frequency_hz=np.full(count, HZ),
        phase_rad=np.array([float(one.turn.spline(one.turn.start_s)) for one in drives]),
        turns=turns,
    )
    marker_m = Twin(ROBOT, FISHSIM_MARKERS, SWIM if in_water else DRY).simulate(runs, time_s).marker_m
    found = []
    for motor, one, marker in zip(motors, drives, marker_m, strict=True):
        read_s = reading_times(motor, one, random)
        log = read_motor(one, read_s, one.turn.spline(read_s), random)
        found.append(Filmed(motor, log, one.commands, time_s, marker, SWIM_SPEC if in_water else SPEC))
    return tuple(found)


def tail_of(one: Filmed, noise: TrackingNoise | None = NOISE, seed: int = 0) -> LateralMotion:
    """The tail's motion as tracked."""
    marker_m = one.marker_m
    if noise is not None:
        errors = lasting_errors(marker_m.shape, 1 / FPS, noise, np.random.default_rng(seed))
        marker_m = np.round(2 * (PX_PER_M * marker_m + errors)) / 2 / PX_PER_M
    lateral = to_head_frame(marker_m, 0, 1).shape_m[:, tail_markers(ROBOT, FISHSIM_MARKERS), 1]
    return LateralMotion(one.time_s, lateral, np.ones(lateral.shape, bool))


def recorded(one: Filmed, tail: LateralMotion | None = None, spec: TrialSpec | None = None) -> MotorRecord:
    """What is made of a drive."""
    tail = tail_of(one) if tail is None else tail
    return motor_record(spec or one.spec, one.log, one.commands, tail, tail.time_s)


def between(tail: LateralMotion, start_s: float, end_s: float) -> LateralMotion:
    """Filmed from and until a time only."""
    kept = (tail.time_s >= start_s) & (tail.time_s < end_s)
    return replace(tail, time_s=tail.time_s[kept], lateral_m=tail.lateral_m[kept], used=tail.used[kept])
