"""Tendons that stretch more than described: by what holds them."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_TYPICAL = 2.0
_YIELDS_M = 0.001  # stretch over which the knots give


@dataclass(frozen=True)
class TendonCompliance(Mechanism):
    """Fittings are springs in series with the lines, and their knots rub as they stretch.

    The friction is a bristle of Dahl's in parallel: z' = s' - |s'| z / 1 mm, tension `loss` k z, with k the spring of
    the whole and s its stretch; a loop of force over stretch that does not depend on speed.

    Attributes:
        left, right: compliance of either line's fittings over that of the line.
        loss: height of the loop, in a millimetre of stretch.
    """

    left: float
    right: float
    loss: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Softer springs with the same time constant."""
        softer = 1 / (1 + np.array([self.left, self.right]))
        return replace(
            parameters,
            tendon_stiffness_n_m=parameters.tendon_stiffness_n_m * softer,
            tendon_damping_n_s_m=parameters.tendon_damping_n_s_m * softer,
        )

    def start(self, now: Instant) -> np.ndarray:
        """(n, 2) the bristles, unbent, m."""
        return np.zeros_like(now.pull.stretch_m)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """The bristles a step later, exact at constant speed."""
        moved = now.pull.rate_m_s * step_s
        end = _YIELDS_M * np.sign(moved)
        return np.asarray(end + (state - end) * np.exp(-np.abs(moved) / _YIELDS_M))

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Of the bristles."""
        return now.tighten(self.loss * now.parameters.tendon_stiffness_n_m * state)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how differently the two lines are held, and how much the knots rub."""
    uneven, loss = random.uniform(-0.05, 0.05), random.uniform(0.05, 0.15)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        relative = _TYPICAL * strength
        rubbing = float(loss * relative / (1 + relative))  # of the stretch, the fittings' share
        return (TendonCompliance(float(relative * (1 + uneven)), float(relative * (1 - uneven)), rubbing),)

    return at
