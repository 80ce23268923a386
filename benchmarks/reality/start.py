"""Start of a simulation: the pose in which springs and tendons balance, moving along with the crank."""

from dataclasses import replace

import numpy as np

from benchmarks.reality.body import Chain
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.tendons import Tendons, Turn

_STAGES = 24  # The crank is followed from the straight tail in this many stages.
_STAGE_ITERATIONS = 6
_LAST_ITERATIONS = 60
_EXTRA_STIFFNESS = 2.0  # The Jacobian has this many times the hinges' stiffness added.
_NUDGE_RAD = 0.01  # The pose's slope is taken over this turn of the crank.
# The tail has snapped into another pose where a hinge turns more than this many times as far as the crank.
_SNAP_SLOPE = 5.0


def balanced_hinges(layout: Layout, parameters: Parameters, turn: Turn) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, h) hinge angles in which the tail rests under its tendons, and their rates as the crank turns, slowly.

    Descends the tail's potential energy, following the crank from the nearest angle at which the tail is straight. The
    steps are Newton's with a Jacobian without the curving of the tendons' paths, made up for by stiffer hinges.
    Where a pulled tail snaps into another pose just there, it starts at rest.
    """
    chain = Chain(layout, parameters)
    tendons = Tendons(layout, replace(parameters, tendon_damping_n_s_m=0 * parameters.tendon_damping_n_s_m), chain)
    hinges = parameters.hinge_rest_rad.copy()
    angle, upright = turn.angle_rad, np.pi * np.round(turn.angle_rad / np.pi)
    for share in np.linspace(0.0, 1.0, _STAGES):
        at = upright + share * (angle - _NUDGE_RAD - upright)
        hinges = _settle(chain, tendons, parameters, hinges, at, _STAGE_ITERATIONS if share < 1 else _LAST_ITERATIONS)
    ahead = _settle(chain, tendons, parameters, hinges, angle, _LAST_ITERATIONS)
    slope = (ahead - hinges) / _NUDGE_RAD
    slope = np.where(np.abs(slope).max(axis=1, keepdims=True) < _SNAP_SLOPE, slope, 0.0)
    return ahead, slope * turn.speed_rad_s


def _settle(
    chain: Chain,
    tendons: Tendons,
    parameters: Parameters,
    hinges: np.ndarray,
    angle_rad: np.ndarray,
    iterations: int,
) -> np.ndarray:
    """Return (n, h) hinge angles with the crank at rest at angles (n, 1), from a guess (n, h)."""
    still = Turn(angle_rad, np.zeros_like(angle_rad))
    to_hinges = np.triu(np.ones((hinges.shape[1], hinges.shape[1])))  # a hinge turns every link behind it
    for _ in range(iterations):
        angles = np.concatenate([np.zeros((len(hinges), 1)), np.cumsum(hinges, axis=1)], axis=1)
        position = np.concatenate([np.zeros((len(hinges), 2)), angles], axis=1)
        pull = tendons.pull(chain.pose(position, np.zeros_like(position)), still, still, 1.0)
        gradient = pull.gradient_m[:, :, 3:] @ to_hinges.T  # (n, 2, h)
        stiffness = parameters.hinge_stiffness_n_m
        jacobian = (1 + _EXTRA_STIFFNESS) * stiffness[:, :, None] * np.eye(hinges.shape[1])
        jacobian = jacobian + (np.swapaxes(gradient, 1, 2) * parameters.tendon_stiffness_n_m[:, None]) @ gradient
        force = -stiffness * (hinges - parameters.hinge_rest_rad) - (pull.tension_n[:, None] @ gradient)[:, 0]
        hinges = hinges + np.linalg.solve(jacobian, force[:, :, None])[..., 0]
    return hinges
