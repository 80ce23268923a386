"""The plan behind `calib new --synthetic` and `datasets/sample`: swim trials, dry runs, free decays."""

import numpy as np

from synthetic.motor import SyntheticMotor
from synthetic.plan import SyntheticPlan
from synthetic.trials import Merge, SyntheticDecay, SyntheticTrial, trial_name

SPEEDS_HZ = (0.4, 0.6, 0.8, 1.0, 1.3)
"""Commanded crank turns a second: the range of the published swim trials."""
FIT_HZ = (0.6, 1.3)
SLIP_S = 0.02
"""The motor is slower than commanded by this share for each turn a second; as published, more so if fast."""
FEWEST_S, FEWEST_BEATS = 5.0, 3.2

DRY_HZ = (0.6, 0.9)
BENT_RAD = ((0.18, 0.21, 0.21, 0.17, 0.08), (-0.2, -0.22, -0.18, -0.12, -0.05), (0.12, 0.17, 0.22, 0.2, 0.12))
"""Of the hinges before each free decay: the tail rings for little over one period, so that one decay is too few."""
BETWEEN_VIDEOS_S = 96.0
"""From the start of one dry run's video to that of the next."""


def default_plan(seed: int = 0) -> SyntheticPlan:
    """Five swim trials of the built-in fish, two dry runs with a motor log, three free decays.

    Two of the swim trials are to fit, three are held out; in the fastest tail_4 merges onto tail_5. The seed is that of
    noise, crank phases, headings and the motor's clock.
    """
    random = np.random.default_rng([seed, len(SPEEDS_HZ)])
    phases, headings = 2 * np.pi * random.random((2, len(SPEEDS_HZ)))
    trials = [_swim(*settings) for settings in zip(SPEEDS_HZ, phases, headings, strict=True)]
    dry_runs, decays = _dry_experiments(np.random.default_rng([seed, len(SPEEDS_HZ), len(DRY_HZ)]))
    return SyntheticPlan(trials=tuple(trials), dry_runs=dry_runs, free_decays=decays, seed=seed)


def _swim(commanded_hz: float, phase_rad: float, heading_rad: float) -> SyntheticTrial:
    fastest = commanded_hz == max(SPEEDS_HZ)
    return SyntheticTrial(
        name=trial_name("f", commanded_hz),
        frequency_hz=_reached(commanded_hz),
        commanded_hz=commanded_hz,
        seconds=max(FEWEST_S, round(FEWEST_BEATS / commanded_hz, 1)),
        role="fit" if commanded_hz in FIT_HZ else "holdout",
        phase_rad=round(float(phase_rad), 3),
        heading_rad=round(float(heading_rad), 3),
        faults=(Merge(marker="tail_4", onto="tail_5", first=120, frames=20),) if fastest else (),
    )


def _dry_experiments(random: np.random.Generator) -> tuple[tuple[SyntheticTrial, ...], tuple[SyntheticDecay, ...]]:
    """One robot in one clamp under one camera, its motor logged by one computer."""
    heading_rad = round(float(2 * np.pi * random.random()), 3)
    first_s, rate = round(float(random.uniform(2000, 9000)), 3), 1 + round(float(random.uniform(-8e-5, 8e-5)), 6)
    runs = []
    for number, hz in enumerate(DRY_HZ):
        starts_s = round(float(random.uniform(0.5, 1.2)), 3)
        clock_s = round(first_s + BETWEEN_VIDEOS_S * number, 3)
        motor = SyntheticMotor(starts_s=starts_s, clock_offset_s=clock_s, clock_rate=rate)
        run = SyntheticTrial(
            name=trial_name("dry_", hz),
            frequency_hz=_reached(hz),
            commanded_hz=hz,
            seconds=round(motor.ends_s + 0.4, 1),
            phase_rad=round(float(2 * np.pi * random.random()), 3),
            heading_rad=heading_rad,
            motor=motor,
        )
        runs.append(run)
    bends = enumerate(BENT_RAD, start=1)
    return tuple(runs), tuple(SyntheticDecay(name=f"decay_{n}", heading_rad=heading_rad, bent_rad=b) for n, b in bends)


def _reached(commanded_hz: float) -> float:
    return round(commanded_hz * (1 - SLIP_S * commanded_hz), 4)
