"""The plan behind `calib new --synthetic` and `datasets/sample`: five speeds, noise, one track fault."""

import numpy as np

from synthetic.faults import Merge
from synthetic.plan import SyntheticPlan, SyntheticTrial

SPEEDS_HZ = (0.4, 0.6, 0.8, 1.0, 1.3)
"""Commanded crank turns a second: the range of the published swims."""
FIT_HZ = (0.6, 1.3)
SLIP_S = 0.02
"""The motor is slower than commanded by this share for each turn a second; as published, more so if fast."""
FEWEST_S, FEWEST_BEATS = 5.0, 3.2


def default_plan(seed: int = 0) -> SyntheticPlan:
    """Five swims of the built-in fish, two to fit, three held out; in the fastest tail_4 merges onto tail_5.

    Args:
        seed: of noise, crank phases and headings.
    """
    random = np.random.default_rng([seed, len(SPEEDS_HZ)])
    phases, headings = 2 * np.pi * random.random((2, len(SPEEDS_HZ)))
    trials = [_trial(*settings) for settings in zip(SPEEDS_HZ, phases, headings, strict=True)]
    return SyntheticPlan(trials=tuple(trials), seed=seed)


def _trial(commanded_hz: float, phase_rad: float, heading_rad: float) -> SyntheticTrial:
    fastest = commanded_hz == max(SPEEDS_HZ)
    return SyntheticTrial(
        name=f"f{commanded_hz:.2f}".replace(".", "_"),
        frequency_hz=round(commanded_hz * (1 - SLIP_S * commanded_hz), 4),
        commanded_hz=commanded_hz,
        seconds=max(FEWEST_S, round(FEWEST_BEATS / commanded_hz, 1)),
        role="fit" if commanded_hz in FIT_HZ else "holdout",
        phase_rad=round(float(phase_rad), 3),
        heading_rad=round(float(heading_rad), 3),
        faults=(Merge(marker="tail_4", onto="tail_5", first=120, frames=20),) if fastest else (),
    )
