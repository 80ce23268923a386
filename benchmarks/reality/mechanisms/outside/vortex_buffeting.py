"""Vortices that the hull sheds and the tail swims through."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_STROUHAL = 0.2  # Roshko, NACA report 1191 (1954)
_LIFT = 0.5
_LINES = np.array([-0.31, -0.17, -0.06, 0.04, 0.15, 0.33])  # of the spectrum, about the Strouhal frequency
_SPREAD = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0])  # turns one drawn number into phases that look drawn each
_LEAST_M_S = 0.02


@dataclass(frozen=True)
class VortexBuffeting(Mechanism):
    """A side force on the fin with lines about f = 0.2 U / D, so that it beats irregularly; no two trials alike.

    Attributes:
        lift: its root mean square over 1/2 rho S U^2, S the fin's area.
        width_m: D, of what sheds.
        luck: 0 to 1, tells the phases of the lines.
    """

    lift: float
    width_m: float
    luck: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 1) widths travelled, from a beginning that another place or crank changes."""
        origin = now.pose.origin_m[:, :1]
        return 1e3 * (np.abs(np.sin(now.turn.angle_rad + now.turn.speed_rad_s)) + np.abs(origin.real + 2 * origin.imag))

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """With the head."""
        return np.asarray(state + self._speed(now) * step_s / self.width_m)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Across the fin, at its middle."""
        robot, direction = now.layout.robot, now.pose.direction[:, -1:]
        fin = robot.caudal_fin
        phase = 2 * np.pi * (_STROUHAL * (1 + _LINES) * state + 100 * self.luck * _SPREAD)
        pressed = 0.5 * now.parameters.density_kg_m3 * fin.chord_m * fin.span_m * self._speed(now) ** 2
        side = self.lift * pressed * np.cos(phase).sum(axis=1, keepdims=True) * np.sqrt(2 / len(_LINES))
        behind = robot.fin_root_x_m + fin.centre_m - now.layout.origin_m[-1]
        return now.push(now.layout.hinges, behind, 1j * side * direction)

    def _speed(self, now: Instant) -> np.ndarray:
        return np.hypot(np.abs(now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s), _LEAST_M_S)


def drawn(random: np.random.Generator) -> AtStrength:
    """A lift coefficient of 0.5 at strength 1, linear; shed by something 20 to 80 mm wide."""
    width, luck = random.uniform(0.02, 0.08), random.random()
    return lambda strength: (VortexBuffeting(_LIFT * strength, width, luck),) if strength else ()
