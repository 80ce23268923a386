"""Dry friction in hinges."""

import numpy as np

from swimmer.effects.effect import StepState
from swimmer.effects.step_damping import StepDamping

CREEP_RAD_S = 0.02
"""Speed at which friction has 0.7 of its full torque: a beat reaches some radians a second."""


class DryFriction:
    """The torque against a hinge's motion, T w / sqrt(w^2 + `CREEP_RAD_S`^2) at speed w, as damping.

    The engine's own dry friction is no help: its solver foresees speeds without the hinges' implicit damping, which
    outweighs the lightest link's inertia 90 times in a step, and at the twin's step it errs by more than the effect.

    Args:
        torque_n_m: (n, h) full torques.
    """

    def __init__(self, torque_n_m: np.ndarray) -> None:
        self._torque = torque_n_m

    def __call__(self, state: StepState) -> StepDamping:
        """For the next step."""
        hinges = self._torque.shape[1]
        joints = np.zeros_like(state.velocity)
        joints[:, -hinges:] = self._torque / np.hypot(state.velocity[:, -hinges:], CREEP_RAD_S)
        return StepDamping(joints=joints)
