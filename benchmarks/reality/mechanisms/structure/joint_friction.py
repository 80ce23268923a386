"""Dry friction in the hinges."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_TORQUE_N_M, _MOST_N_M = 0.03, 0.3
_BRISTLE_RAD = 0.005  # bend of the bristles of a hinge where they slip


@dataclass(frozen=True)
class JointFriction(Mechanism):
    """The LuGre model: bristles bend before they slip, with a higher torque to break away than to keep sliding.

    Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Automatic Control 40 (1995): z' = w - |w| z s_0 / g(w),
    torque s_0 z, g(w) = T (1 + e exp(-(w / w_s)^2)); the hinge's own damper stands for that of the bristles. The state
    is where the bristles' roots are, q - z, so that within a step they are a spring.

    Attributes:
        torque_n_m: T, when sliding.
        excess: e, of the break-away torque.
        stribeck_rad_s: w_s.
    """

    torque_n_m: float
    excess: float
    stribeck_rad_s: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """The bristles are taken implicitly."""
        extra = parameters.extra_implicit_stiffness_n_m + self.torque_n_m / _BRISTLE_RAD
        return replace(parameters, extra_implicit_stiffness_n_m=extra)

    def start(self, now: Instant) -> np.ndarray:
        """(n, h) roots, the bristles upright."""
        return now.pose.hinge_rad

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """The roots follow where the bristles slip: exact at an even rate, for the mean bend over a step."""
        rate = now.pose.hinge_rate_rad_s
        slipping = _BRISTLE_RAD * (1 + self.excess * np.exp(-((rate / self.stribeck_rad_s) ** 2)))
        beyond = now.pose.hinge_rad - state + rate * step_s / 2 - np.sign(rate) * slipping
        return np.asarray(state + rate * step_s - beyond * np.expm1(-np.abs(rate) * step_s / slipping))

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Of the bristles on the hinges."""
        return now.bend(-self.torque_n_m / _BRISTLE_RAD * (now.pose.hinge_rad - state))


def drawn(random: np.random.Generator) -> AtStrength:
    """0.03 N m in each gap at strength 1; saturates at 0.3 N m, which holds a gap bent by half a radian."""
    excess, stribeck = random.uniform(0.05, 0.2), random.uniform(0.02, 0.1)
    return lambda strength: (
        (JointFriction(_MOST_N_M * float(np.tanh(_TORQUE_N_M * strength / _MOST_N_M)), excess, stribeck),)
        if strength
        else ()
    )
