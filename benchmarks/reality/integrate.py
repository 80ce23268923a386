"""Integrator: a linearly implicit Rosenbrock-W method of second order for mass q'' = force.

ROS2 of Verwer, Spee, Blom and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999) with gamma = 1 - 1/sqrt(2): L-stable, and of
second order whatever matrix replaces the Jacobian. Here that matrix holds springs, dampers and tendons, whose rates
exceed 10^4 per second, and about how the water resists; all else is taken explicitly. For u = (q, q') the stages are

    (1 - gamma h A) k1 = h F(t, u) + gamma h^2 F_t,
    (1 - gamma h A) k2 = h F(t + h, u + k1) - 2 k1 - gamma h^2 F_t,      u + 3/2 k1 + 1/2 k2,

each of which comes down to one system of the size of q with the matrix M + gamma h D + (gamma h)^2 K.
"""

import numpy as np

from benchmarks.reality.motion import Equations, Motion

GAMMA = 1 - 1 / np.sqrt(2)


def step(
    motion: Motion,
    time_s: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    states: list[np.ndarray],
    step_s: float,
) -> tuple[np.ndarray, np.ndarray, Equations]:
    """Return coordinates and rates (n, N) a step later; and the equations from which the step began.

    Args:
        motion: the equations.
        time_s: (n, 1) times, s.
        position: (n, N) coordinates.
        velocity: (n, N) rates of the coordinates.
        states: own states of the mechanisms, which are constant during the step.
        step_s: length h of the step, s.
    """
    h, g = step_s, GAMMA * step_s
    held = motion.parameters.head_clamped
    first = motion.equations(time_s, position, velocity, states, h)
    drift = g * h * first.force_rate
    speed_1 = _solve(first, g, h * first.force - g * h * _multiply(first.stiffness, velocity) + drift, held)
    place_1 = h * velocity + g * speed_1

    second = motion.equations(time_s + h, position + place_1, velocity + speed_1, states, h)
    ahead = h * (velocity + speed_1) - 2 * place_1
    right = h * second.force - 2 * _multiply(second.mass, speed_1) - g * _multiply(second.stiffness, ahead) - drift
    speed_2 = _solve(second, g, right, held)
    place_2 = ahead + g * speed_2
    return position + 1.5 * place_1 + 0.5 * place_2, velocity + 1.5 * speed_1 + 0.5 * speed_2, first


def _solve(at: Equations, g: float, right: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return the (n, N) solution with M + g D + g^2 K; the head's three coordinates stay 0 where it is held, (n, 1)."""
    matrix = at.mass + g * at.damping + g**2 * at.stiffness
    clamped = np.flatnonzero(held)
    if len(clamped):
        matrix[clamped, :3] = matrix[clamped, :, :3] = 0.0
        matrix[clamped[:, None], np.arange(3), np.arange(3)] = 1.0
        right[clamped, :3] = 0.0
    return np.linalg.solve(matrix, right[:, :, None])[..., 0]


def _multiply(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return (matrix @ vector[:, :, None])[..., 0]
