"""A coupling between motor and crank that slips under load."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.tendons import Turn

_SLIP_RAD_N_M_S = 0.15
_LAG_S = 0.02


@dataclass(frozen=True)
class SlippingCoupling(Mechanism):
    """The crank turns back against the motor wherever the torque through the coupling is more than that holds.

    The state is the angle lost, the rate at which it grows, and since when; the rate lags a little behind the torque.

    Attributes:
        holds_n_m: torque without slip.
        slip_rad_n_m_s: rate of the slip over the torque beyond.
    """

    holds_n_m: float
    slip_rad_n_m_s: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 3) nothing lost."""
        return np.concatenate([np.zeros((len(now.time_s), 2)), now.time_s], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """By the torque of the moment."""
        lost = state[:, :1] + state[:, 1:2] * step_s
        torque = now.pull.crank_torque_n_m
        told = self.slip_rad_n_m_s * np.sign(torque) * np.maximum(np.abs(torque) - self.holds_n_m, 0.0)
        slip = told + np.exp(-step_s / _LAG_S) * (state[:, 1:2] - told)
        return np.concatenate([lost, slip, now.time_s + step_s], axis=1)

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:
        """Behind the motor by what is lost."""
        lost, slip, since_s = state[:, 0:1], state[:, 1:2], state[:, 2:3]
        return Turn(turn.angle_rad - lost - slip * (time_s - since_s), turn.speed_rad_s - slip)


def drawn(random: np.random.Generator) -> AtStrength:
    """Slips beyond 0.3 to 0.6 N m; the rate is linear in the strength."""
    holds = random.uniform(0.3, 0.6)
    return lambda strength: (SlippingCoupling(holds, _SLIP_RAD_N_M_S * strength),) if strength else ()
