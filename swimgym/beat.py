"""A beat of the tail with one motor from two numbers: how fast it is, and how much to one side.

The crank's angle is the clock: it turns at 2 pi f (1 - s sin(angle)), so the tail lingers on one side and hurries
through the other, which turns the robot. Nothing is remembered between actions.
"""

import numpy as np

from swimgym.course import Rules

MOST_ASIDE = 0.95


def beat_action(rules: Rules, seen: np.ndarray, hz: np.ndarray, aside: np.ndarray) -> np.ndarray:
    """Compute the (n,) accelerations in [-1, 1] that keep up a beat.

    Args:
        rules: rules of the course.
        seen: (n, o) observations, of which those of the crank are used.
        hz: (n,) turns of the crank a second, in the mean over its angle.
        aside: (n,) how much the beat is to the left, from -1 to 1.
    """
    sine, speed = seen[:, 1], seen[:, 2]
    wanted = 2 * np.pi * np.minimum(hz, rules.fastest_hz) * (1 - MOST_ASIDE * np.clip(aside, -1.0, 1.0) * sine)
    return np.clip((wanted - speed) / (rules.acceleration_rad_s2 * rules.interval_s), -1.0, 1.0)
