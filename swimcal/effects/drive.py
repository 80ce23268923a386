"""Effects of the motor: its mean speed, its pace within a trial and within a turn, and its start.

Those that change the pace turn the crank by another `Turn`: `WarpedTurn` passes through the same angles at other times,
`RippledTurn` speeds up and slows down twice in every turn.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from swimcal.effects.effect import Drive, Effect, Parameter
from swimcal.runs import Turn

WARMING_S = 5.0
"""Time constant of the winding; over as long from the start the mean speed is the measured one."""
_MEAN = 1 - np.exp(-1.0)  # mean of exp(-t / WARMING_S) over that time


@dataclass(frozen=True)
class EvenTurn:
    """A crank that turns evenly.

    Attributes:
        speed_rad_s: speed of the crank, rad/s.
    """

    speed_rad_s: float
    logged: bool = False

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        return self.speed_rad_s * np.asarray(time_s, float)

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        return np.full(np.shape(time_s), self.speed_rad_s)


def turn_of(drive: Drive) -> Turn:
    """Return the turn that a crank makes, even or not."""
    return EvenTurn(2 * np.pi * drive.frequency_hz) if drive.turn is None else drive.turn


@dataclass(frozen=True, eq=False)
class WarpedTurn:
    """A turn made at another pace.

    Attributes:
        turn: the turn at its own pace.
        pace: the pace at which it is made.
    """

    turn: Turn
    pace: "WarmingPace | LatePace"

    @property
    def logged(self) -> bool:
        """Return whether a log shows the turn that is warped."""
        return self.turn.logged

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        return np.asarray(self.turn.angle(self.pace.reached_s(np.asarray(time_s, float))))

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        time_s = np.asarray(time_s, float)
        return np.asarray(self.turn.speed(self.pace.reached_s(time_s)) * self.pace.rate(time_s))


class DriveEffect(Effect):
    """Effect of the motor."""

    family = "drive"
    stage = "drive"
    seen_in = frozenset({"dry", "swim"})


class DriveRatioError(DriveEffect):
    """The crank turns at (1 + relative) times the command; the turn itself is even, and known by its frequency."""

    name = "drive_ratio_error"
    physics = "A gear ratio, pulley or speed unit that differs from the described one scales every speed by one factor."
    source = "Kinematics of gearing; the unit of an XW540's goal speed is 0.229 turns a minute."
    parameters = (Parameter("relative", "1", -0.4, 0.4, 0.02),)

    def turned_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """Return the frequency at the wrong ratio, Hz."""
        return float(commanded_hz * (1 + values[0]))


@dataclass(frozen=True)
class WarmingPace:
    """A pace that falls by a share, from 1 + (1 - mean) share to 1 - mean share, with mean 1 over `WARMING_S`."""

    share: float

    def reached_s(self, time_s: np.ndarray) -> np.ndarray:
        """Return the time (f,) that the turn has reached, s."""
        cooler_s = -WARMING_S * np.expm1(-time_s / WARMING_S) - _MEAN * time_s
        return np.asarray(time_s + self.share * cooler_s)

    def rate(self, time_s: np.ndarray) -> np.ndarray:
        """Return the pace (f,), 1 on the mean."""
        return np.asarray(1 + self.share * (np.exp(-time_s / WARMING_S) - _MEAN))


class MotorSpeedSag(DriveEffect):
    """The share of speed that is lost grows with the load, which grows with the square of the speed."""

    name = "motor_speed_sag"
    physics = "A DC motor at its voltage limit loses speed with its torque, and more as its winding warms up."
    source = (
        "Torque-speed line of a DC motor; drag grows with speed squared; copper gains 0.39 % resistance per kelvin."
    )
    parameters = (Parameter("load", "s^2", 0.0, 0.3, 0.03), Parameter("warming", "1", 0.0, 0.3, 0.02))

    def turned_hz(self, commanded_hz: float, values: np.ndarray) -> float:
        """Return f / (1 + load f^2), Hz: the motor loses the share `load` f^2 of its actual speed."""
        return float(commanded_hz / (1 + values[0] * commanded_hz**2))

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """Slow the crank down over time, with the same mean speed."""
        if values[1] == 0:
            return drive
        return drive._replace(turn=WarpedTurn(turn_of(drive), WarmingPace(float(values[1]))))


@dataclass(frozen=True, eq=False)
class RippledTurn:
    """A turn whose speed is modulated twice in every turn of the crank: each tendon pulls once.

    Attributes:
        turn: the turn without the ripple.
        phase_rad: angle of the crank at time 0.
        cosine, sine: relative amplitudes of the speed.
    """

    turn: Turn
    phase_rad: float
    cosine: float
    sine: float

    @property
    def logged(self) -> bool:
        """Return whether a log shows the turn that is rippled."""
        return self.turn.logged

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        even = self.turn.angle(time_s)
        return np.asarray(even + self._ahead(even) - self._ahead(np.zeros(1))[0])

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        twice = 2 * (self.turn.angle(time_s) + self.phase_rad)
        return np.asarray(self.turn.speed(time_s) * (1 + self.cosine * np.cos(twice) + self.sine * np.sin(twice)))

    def _ahead(self, even: np.ndarray) -> np.ndarray:
        twice = 2 * (even + self.phase_rad)
        return np.asarray((self.cosine * np.sin(twice) - self.sine * np.cos(twice)) / 2)


class MotorSpeedRipple(DriveEffect):
    """The crank slows down where the tendons pull hardest, and hurries in between.

    The change of frequency is the same at any speed, since most of the pull is that of the hinges' springs.
    """

    name = "motor_speed_ripple"
    physics = "Under a load that comes twice a turn a speed-controlled motor turns unevenly, by load over gain."
    source = "First order response of a proportional speed loop to a periodic load."
    parameters = (Parameter("cosine", "Hz", -0.3, 0.3, 0.05), Parameter("sine", "Hz", -0.3, 0.3, 0.05))

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """Add the ripple to the crank's turn."""
        if not values.any():
            return drive
        cosine, sine = map(float, values / drive.frequency_hz)
        return drive._replace(turn=RippledTurn(turn_of(drive), drive.phase_rad, cosine, sine))


@dataclass(frozen=True)
class LatePace:
    """A pace after a delay above 0: rest for 3/4 of it, reach full speed over half of it, then stay late by it."""

    delay_s: float

    def reached_s(self, time_s: np.ndarray) -> np.ndarray:
        """Return the time (f,) that the turn has reached, s."""
        u = self._start_up(time_s)
        return np.asarray(self.delay_s * u**3 * (1 - u / 2) / 2 + np.maximum(time_s - 1.25 * self.delay_s, 0.0))

    def rate(self, time_s: np.ndarray) -> np.ndarray:
        """Return the pace (f,), from 0 to 1 by the smooth step 3 u^2 - 2 u^3."""
        u = self._start_up(time_s)
        return np.asarray(u**2 * (3 - 2 * u))

    def _start_up(self, time_s: np.ndarray) -> np.ndarray:
        return np.asarray(np.clip(2 * time_s / self.delay_s - 1.5, 0.0, 1.0))


class MotorStartDelay(DriveEffect):
    """The crank rests at its phase for a while, then turns."""

    name = "motor_start_delay"
    physics = "Between the first frame and the motor's start are the host's and the bus's delay and the speed ramp."
    source = "Kinematics: a turn made later."
    needs_log = True
    parameters = (Parameter("delay", "s", 0.0, 1.0, 0.05),)

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """Delay the crank's turn."""
        if values[0] == 0:
            return drive
        return drive._replace(turn=WarpedTurn(turn_of(drive), LatePace(float(values[0]))))


EFFECTS: tuple[Effect, ...] = (
    DriveRatioError(),
    MotorSpeedSag(),
    MotorSpeedRipple(),
    MotorStartDelay(),
)
