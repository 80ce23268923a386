"""Mechanisms of crank and motor."""

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import AtStrength, Mechanism
from benchmarks.reality.tendons import Turn


class DriveRatioError(Mechanism):
    """Crank that turns (1 + relative) times as far as commanded, since the start of the run-in.

    The wheel that is wrong also runs out of true: angles e ahead of and behind the mean, once a turn.
    """

    relative: float  # error of the ratio
    runout_rad: float  # e

    def start(self, now: Instant) -> np.ndarray:
        """Return the (n, 1) angle from which the crank starts, rad."""
        return now.turn.angle_rad

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        """Turn the crank further."""
        turned = (1 + self.relative) * (turn.angle_rad - state)
        ahead, rate = self.runout_rad * np.sin(turned), 1 + self.runout_rad * np.cos(turned)
        return Turn(state + turned + ahead, (1 + self.relative) * turn.speed_rad_s * rate)


def drive_ratio_error(random: np.random.Generator) -> AtStrength:
    """Draw faster or slower, and how far the wheel runs out of true."""
    typical = 0.02
    sign, runout = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.1)
    return lambda strength: (DriveRatioError(sign * typical * strength, runout * (typical * strength)),)


_LOAD_N_M = 0.45  # The tendons ask for a torque of this mean size.
_AVERAGED_S = 0.5  # time constant of the averaged load
_WARMED_S = 5.0  # time constant of the winding's heat


class LateCrank(Mechanism):
    """Crank behind the commanded turn. Its state begins with the time s, the angle behind rad and its rate rad/s."""

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 3) with nothing behind."""
        return np.concatenate([now.time_s, np.zeros((len(now.time_s), 2))], axis=1)

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:
        """Turn the crank behind, or ahead."""
        since, behind, rate = np.split(state[:, :3], 3, axis=1)
        return Turn(turn.angle_rad - behind - rate * (time_s - since), turn.speed_rad_s - rate)


class MotorSpeedSag(LateCrank):
    """Approach of a commanded speed to the motor's limit: w = commanded (1 + x^p)^(-1/p), x = commanded / limit.

    The limit falls with the load, a torque averaged over half a second, and with the heat that its square leaves in the
    winding (0.39 % more resistance a kelvin): x^p = p loss f^p load (1 + warmth heat), f in turns a second. The share
    lost at 1 Hz is `loss` where it is small, and grows with f^p.
    """

    loss: float  # share lost at 1 Hz under the usual load, cold
    exponent: float  # p
    warmth: float  # growth of the loss in a warm winding

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 5) with load and heat, both relative to what is usual; cold."""
        return np.concatenate([super().start(now), np.zeros((len(now.time_s), 2))], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Return load, heat and speed a step later."""
        time_s, behind, rate, load, heat = np.split(state, 5, axis=1)
        asked = np.abs(now.pull.crank_torque_n_m) / _LOAD_N_M
        load = load + step_s / _AVERAGED_S * (asked - load)
        heat = heat + step_s / _WARMED_S * (load**2 - heat)
        commanded = now.turn.speed_rad_s + rate
        p = self.exponent
        beyond = p * self.loss * np.abs(commanded / (2 * np.pi)) ** p * load * (1 + self.warmth * heat)
        lost = commanded * -np.expm1(-np.log1p(beyond) / p)
        return np.concatenate([time_s + step_s, behind + step_s * rate, lost, load, heat], axis=1)


def motor_speed_sag(random: np.random.Generator) -> AtStrength:
    """Draw how sharply the limit comes, and how much the winding's heat matters."""
    typical = 0.03  # share of the speed that is lost at one turn a second
    exponent, warmth = random.uniform(2.0, 3.5), random.uniform(0.2, 0.8)
    return lambda strength: (MotorSpeedSag(typical * strength, exponent, warmth),)


_INERTIA_KG_M2 = 0.01  # inertia of the rotor, at the crank
_CAUGHT_UP_S = 2.0  # time constant of the loop's integral


class MotorSpeedRipple(LateCrank):
    """A rotor under a soft speed loop, d the angle behind: J d'' = torque - gain (d' + d / 2 s), torque the tendons'.

    Its integral keeps the mean speed as commanded. All harmonics of the torque come through. The gear passes less of a
    torque that drives the motor than of one that holds it.
    """

    gain_n_m_s: float  # gain of the loop
    back: float  # share of a driving torque that reaches the motor

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Take a step of the rotor, implicit in its rate."""
        time_s, behind, rate = np.split(state, 3, axis=1)
        torque = now.pull.crank_torque_n_m
        torque = torque * np.where(torque > 0, 1.0, self.back)
        behind = behind + step_s * rate
        push = torque - self.gain_n_m_s / _CAUGHT_UP_S * behind
        rate = (_INERTIA_KG_M2 * rate + step_s * push) / (_INERTIA_KG_M2 + step_s * self.gain_n_m_s)
        return np.concatenate([time_s + step_s, behind, rate], axis=1)


def motor_speed_ripple(random: np.random.Generator) -> AtStrength:
    """Draw how well the gear can be driven backwards; the loop gets no softer than 5 times the typical one."""
    typical_n_m_s = 2.0  # torque per rad/s of speed error, for a ripple of 5 % at one turn a second
    most = 5.0  # times as soft
    back = random.uniform(0.8, 1.0)
    return lambda strength: (MotorSpeedRipple(typical_n_m_s * (1 / strength + 1 / most), back),)


_STOPS_S = 0.1  # The crank comes to rest within at most this time.


class MotorStartDelay(Mechanism):
    """Crank that rests for a while from the first frame, then spins up to its speed as a first-order lag.

    In the run-in it turns as commanded and comes to rest just at the first frame, at the angle commanded for then.
    """

    rest_s: float  # time for which it does not move
    spin_up_s: float  # time constant; in the end it is late by the sum of both

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        """Turn the crank late by t - reached(t)."""
        stops_s = np.minimum(self.rest_s + self.spin_up_s, _STOPS_S)
        before, after = np.minimum(time_s, 0.0), np.maximum(time_s - self.rest_s, 0.0)
        fading, begun = np.exp(before / stops_s), np.exp(-after / self.spin_up_s)
        reached = np.where(time_s < 0, before * (1 - fading), after - self.spin_up_s * (1 - begun))
        pace = np.where(time_s < 0, 1 - fading * (1 + before / stops_s), 1 - begun)
        return Turn(turn.angle_rad - turn.speed_rad_s * (time_s - reached), turn.speed_rad_s * pace)


def motor_start_delay(random: np.random.Generator) -> AtStrength:
    """Draw how much of the delay is rest and how much is spin-up."""
    typical_s = 0.05
    rest = random.uniform(0.3, 0.7)
    return lambda strength: (MotorStartDelay(rest * (typical_s * strength), (1 - rest) * (typical_s * strength)),)
