"""A steering law of a few numbers, which a search can find in minutes: towards the target, in tune with the beat.

How much the beat is to one side is tanh of a weighted sum of the bearing of the target and of numbers that follow the
swing of the head within a beat. No side is preferred: left and right mirror each other. A target within the turning
circle cannot be reached by turning towards it; there the swimmer turns away until it can (as paths of bounded curvature
have to: Dubins, Am. J. Math. 79, 1957).
"""

import numpy as np

from swimgym.beat import beat_action
from swimgym.course import Rules

GAINS = ("bearing", "bearing_sign", "yaw_rate", "crank_cos", "crank_sin", "drift")
_SIGN_RAD = 0.1  # width of the soft sign of the bearing


def numbers_of(hinges: int) -> tuple[str, ...]:
    """Name the numbers of a law: frequency (logit of its share of the fastest), turning radius (m), gains."""
    return ("hz_logit", "turning_m", *GAINS, *(f"tail_{i + 1}" for i in range(hinges)))


def start_of(task: str, hinges: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the (p,) numbers at which a search of the law begins, and the (p,) widths of the search about them."""
    names = numbers_of(hinges)
    middle, width = np.zeros(len(names)), np.full(len(names), 0.4)
    middle[:3] = 0.4, (1.0 if task == "target" else 0.5), 6.0
    width[:3] = 0.5, 0.15, 2.0
    return middle, width


def steered(numbers: np.ndarray, rules: Rules, seen: np.ndarray) -> np.ndarray:
    """Compute the (n,) actions of swimmers that steer by laws (p,) or (n, p), given what they see (n, o).

    Args:
        numbers: (p,) or (n, p) numbers of the laws, see `numbers_of`.
        rules: rules of the course.
        seen: (n, o) what the swimmers see.
    """
    numbers = np.broadcast_to(numbers, (len(seen), numbers.shape[-1]))
    hinges = numbers.shape[1] - 2 - len(GAINS)
    vector = seen[:, -5:-3]
    bearing = np.arctan2(-vector[:, 1], -vector[:, 0])  # to the left
    side = np.sign(bearing)
    told = np.stack(
        [
            bearing,
            np.tanh(bearing / _SIGN_RAD),
            seen[:, 5],
            seen[:, 0],
            seen[:, 1],
            seen[:, -2],
            *seen[:, 6 : 6 + hinges].T,
        ],
        axis=1,
    )
    aside = np.tanh((numbers[:, 2:] * told).sum(axis=1))
    turning = np.abs(numbers[:, 1])
    within = np.hypot(vector[:, 0], vector[:, 1] + side * turning) < turning
    hz = rules.fastest_hz / (1 + np.exp(-numbers[:, 0]))
    return beat_action(rules, seen, hz, np.where(within, -side, aside))
