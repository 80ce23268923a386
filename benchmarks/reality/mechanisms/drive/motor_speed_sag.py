"""A motor too weak for its load: slower than told, and slower still as its winding warms up."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.tendons import Turn

_TYPICAL = 0.03  # of the speed, lost at one turn a second
_LOAD_N_M = 0.45  # mean size of the torque that the tendons ask for
_AVERAGED_S, _WARMED_S = 0.5, 5.0


@dataclass(frozen=True)
class MotorSpeedSag(Mechanism):
    """A speed told approaches the motor's limit: w = told (1 + x^p)^(-1/p), x = told / limit.

    The limit falls with the load, a torque averaged over half a second, and with the heat that its square leaves in the
    winding (0.39 % more resistance a kelvin): x^p = p loss f^p load (1 + warmth heat), f in turns a second. The share
    lost at 1 Hz is `loss` where it is small, and grows with f^p.

    Attributes:
        loss: at 1 Hz under the usual load, cold.
        exponent: p.
        warmth: more of it in a warm winding.
    """

    loss: float
    exponent: float
    warmth: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 5) time s, angle behind rad, its rate rad/s, load and heat, both relative to what is usual; cold."""
        return np.concatenate([now.time_s, np.zeros((len(now.time_s), 4))], axis=1)

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:
        """Behind."""
        since, behind, rate = state[:, 0:1], state[:, 1:2], state[:, 2:3]
        return Turn(turn.angle_rad - behind - rate * (time_s - since), turn.speed_rad_s - rate)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Load, heat and speed a step later."""
        time_s, behind, rate, load, heat = np.split(state, 5, axis=1)
        asked = np.abs(now.pull.crank_torque_n_m) / _LOAD_N_M
        load = load + step_s / _AVERAGED_S * (asked - load)
        heat = heat + step_s / _WARMED_S * (load**2 - heat)
        told = now.turn.speed_rad_s + rate
        p = self.exponent
        beyond = p * self.loss * np.abs(told / (2 * np.pi)) ** p * load * (1 + self.warmth * heat)
        lost = told * -np.expm1(-np.log1p(beyond) / p)
        return np.concatenate([time_s + step_s, behind + step_s * rate, lost, load, heat], axis=1)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how sharply the limit comes, and how much the winding's heat matters."""
    exponent, warmth = random.uniform(2.0, 3.5), random.uniform(0.2, 0.8)

    def at(strength: float) -> tuple[Mechanism, ...]:
        return (MotorSpeedSag(_TYPICAL * strength, float(exponent), float(warmth)),) if strength else ()

    return at
