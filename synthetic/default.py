"""The plan behind `calib new --synthetic` and `datasets/sample`: swim trials, dry runs, free decays."""

import numpy as np

from session.create import FISHSIM_MARKERS
from swimmer import RobotSpec
from synthetic.motor import SyntheticMotor
from synthetic.plan import SyntheticPlan
from synthetic.trials import Merge, SyntheticDecay, SyntheticTrial, trial_name

SPEEDS_HZ = (0.4, 0.6, 0.8, 1.0, 1.3)
"""Commanded crank turns a second: the range of the published swim trials."""
FIT_HZ = (0.6, 1.3)
SLIP_S = 0.02
"""The motor is slower than commanded by this share for each turn a second; as published, more so if fast."""
FEWEST_S = 5.0  # shortest swim
FEWEST_BEATS = 3.2  # in any swim

DRY_HZ = (0.6, 0.9)
BENT_RAD = ((0.18, 0.21, 0.21, 0.17, 0.08), (-0.2, -0.22, -0.18, -0.12, -0.05), (0.12, 0.17, 0.22, 0.2, 0.12))
"""Angles of five hinges before each free decay. The tail rings for little over one period: one decay is too few."""
BETWEEN_VIDEOS_S = 96.0
"""Time from the start of one dry run's video to that of the next."""


def default_plan(seed: int = 0, robot: RobotSpec | None = None) -> SyntheticPlan:
    """Plan five swim trials of a robot, two dry runs with a motor log, and three free decays.

    Two of the swim trials are to fit, three are held out. In the fastest the last but two of the markers merges onto
    the next, in the built-in fish tail_4 onto tail_5.

    Args:
        seed: draws noise, crank phases, headings and the motor's clock.
        robot: None for the built-in fish; another one is bent and tracked at its own hinges and markers.
    """
    markers = FISHSIM_MARKERS if robot is None else tuple(robot.markers)
    random = np.random.default_rng([seed, len(SPEEDS_HZ)])
    phases, headings = 2 * np.pi * random.random((2, len(SPEEDS_HZ)))
    trials = [_swim(*settings, markers) for settings in zip(SPEEDS_HZ, phases, headings, strict=True)]
    of_motor = np.random.default_rng([seed, len(SPEEDS_HZ), len(DRY_HZ)])
    dry_runs, decays = _dry_experiments(of_motor, BENT_RAD if robot is None else _bend(len(robot.hinges)))
    return SyntheticPlan(
        trials=tuple(trials), dry_runs=dry_runs, free_decays=decays, seed=seed, robot=robot, markers=markers
    )


def _bend(hinges: int) -> tuple[tuple[float, ...], ...]:
    """Spread `BENT_RAD` along a tail of this many hinges, so that the tip is as far off."""
    along, places = np.linspace(0.0, 1.0, len(BENT_RAD[0])), np.linspace(0.0, 1.0, hinges)
    less = len(BENT_RAD[0]) / hinges
    return tuple(tuple(round(float(b) * less, 4) for b in np.interp(places, along, bent)) for bent in BENT_RAD)


def _swim(commanded_hz: float, phase_rad: float, heading_rad: float, markers: tuple[str, ...]) -> SyntheticTrial:
    fastest = commanded_hz == max(SPEEDS_HZ) and not {"nose", "neck"} & set(markers[-3:-1])
    return SyntheticTrial(
        name=trial_name("f", commanded_hz),
        frequency_hz=_reach(commanded_hz),
        commanded_hz=commanded_hz,
        seconds=max(FEWEST_S, round(FEWEST_BEATS / commanded_hz, 1)),
        role="fit" if commanded_hz in FIT_HZ else "holdout",
        phase_rad=round(float(phase_rad), 3),
        heading_rad=round(float(heading_rad), 3),
        faults=(Merge(marker=markers[-3], onto=markers[-2], first=120, frames=20),) if fastest else (),
    )


def _dry_experiments(
    random: np.random.Generator, bends_rad: tuple[tuple[float, ...], ...]
) -> tuple[tuple[SyntheticTrial, ...], tuple[SyntheticDecay, ...]]:
    """Plan dry runs and free decays of one robot in one clamp under one camera, its motor logged by one computer."""
    heading_rad = round(float(2 * np.pi * random.random()), 3)
    first_s, rate = round(float(random.uniform(2000, 9000)), 3), 1 + round(float(random.uniform(-8e-5, 8e-5)), 6)
    runs = []
    for number, hz in enumerate(DRY_HZ):
        starts_s = round(float(random.uniform(0.5, 1.2)), 3)
        clock_s = round(first_s + BETWEEN_VIDEOS_S * number, 3)
        motor = SyntheticMotor(starts_s=starts_s, clock_offset_s=clock_s, clock_rate=rate)
        run = SyntheticTrial(
            name=trial_name("dry_", hz),
            frequency_hz=_reach(hz),
            commanded_hz=hz,
            seconds=round(motor.ends_s + 0.4, 1),
            phase_rad=round(float(2 * np.pi * random.random()), 3),
            heading_rad=heading_rad,
            motor=motor,
        )
        runs.append(run)
    bends = enumerate(bends_rad, start=1)
    return tuple(runs), tuple(SyntheticDecay(name=f"decay_{n}", heading_rad=heading_rad, bent_rad=b) for n, b in bends)


def _reach(commanded_hz: float) -> float:
    return round(commanded_hz * (1 - SLIP_S * commanded_hz), 4)
