"""A motor whose speed goes up and down with the pull of the tendons."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.tendons import Turn

_TYPICAL_N_M_S = 2.0  # torque per rad/s of speed error, for a ripple of 5 % at one turn a second
_MOST = 5.0  # times as soft
_INERTIA_KG_M2 = 0.01
_CAUGHT_UP_S = 2.0


@dataclass(frozen=True)
class MotorSpeedRipple(Mechanism):
    """A rotor under a soft speed loop, d the angle behind: J d'' = torque - gain (d' + d / 2 s), torque the tendons'.

    Its integral keeps the mean speed as told. All harmonics of the torque come through. The gear passes less of a
    torque that drives the motor than of one that holds it.

    Attributes:
        gain_n_m_s: of the loop.
        back: share of a driving torque that reaches the motor.
    """

    gain_n_m_s: float
    back: float

    def start(self, now: Instant) -> np.ndarray:
        """(n, 3) time s, angle behind rad, its rate rad/s."""
        return np.concatenate([now.time_s, np.zeros((len(now.time_s), 2))], axis=1)

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:
        """Behind, or ahead."""
        since, behind, rate = np.split(state, 3, axis=1)
        return Turn(turn.angle_rad - behind - rate * (time_s - since), turn.speed_rad_s - rate)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """A step of the rotor, implicit in its rate."""
        time_s, behind, rate = np.split(state, 3, axis=1)
        torque = now.pull.crank_torque_n_m
        torque = torque * np.where(torque > 0, 1.0, self.back)
        behind = behind + step_s * rate
        push = torque - self.gain_n_m_s / _CAUGHT_UP_S * behind
        rate = (_INERTIA_KG_M2 * rate + step_s * push) / (_INERTIA_KG_M2 + step_s * self.gain_n_m_s)
        return np.concatenate([time_s + step_s, behind, rate], axis=1)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how well the gear can be driven backwards; the loop gets no softer than 5 times the typical one."""
    back = random.uniform(0.8, 1.0)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        return (MotorSpeedRipple(_TYPICAL_N_M_S * (1 / strength + 1 / _MOST), float(back)),)

    return at
