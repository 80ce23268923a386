"""The turn of the crank in a trial: a measured angle over time, in place of an even turn."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_smoothing_spline

RESOLUTION_S = 0.02
"""Changes of speed faster than about this are taken for the encoder's steps and the host's uneven reading."""
_FEWEST = 5  # readings that a smoothing spline needs


class Turn(Protocol):
    """A turn of the crank from time 0 on; `logged` if a log shows it, so that no load changes it."""

    @property
    def logged(self) -> bool: ...  # noqa: D102

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        ...

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        ...


@dataclass(frozen=True, eq=False)
class CrankTurn:
    """A measured turn of the crank, for instance from the motor's log.

    Attributes:
        spline: angle (rad) over time (s); unwrapped, in the direction in which it grows as a whole.
        start_s, end_s: the measured stretch; beyond it the crank turns on with the speed it had there.
    """

    spline: BSpline
    start_s: float
    end_s: float
    logged: bool = True

    @classmethod
    def measured(cls, time_s: np.ndarray, angle_rad: np.ndarray) -> "CrankTurn":
        """Fit a smoothing cubic spline to k readings (Woltring 1986).

        Which way round the shaft turned is left out: the tail of a robot with equal tendons moves the same either way,
        half a turn apart.

        Args:
            time_s: (k,) s.
            angle_rad: (k,) unwrapped angle, rad.

        Raises:
            ValueError: fewer than five readings, or times that do not grow.
        """
        if len(time_s) < _FEWEST or not (np.diff(time_s) > 0).all():
            raise ValueError(f"time_s: found {len(time_s)} readings, expected at least {_FEWEST} at growing times")
        forward = 1.0 if angle_rad[-1] >= angle_rad[0] else -1.0
        spacing = float(np.median(np.diff(time_s)))
        spline = make_smoothing_spline(time_s, forward * angle_rad, lam=RESOLUTION_S**4 / (16 * spacing))
        return cls(spline, float(time_s[0]), float(time_s[-1]))

    def shifted(self, offset_s: float, rate: float = 1.0) -> "CrankTurn":
        """Return the same turn on another clock, on which its instant ``t`` is ``(t - offset_s) / rate``."""
        knots = (self.spline.t - offset_s) / rate
        return CrankTurn(
            BSpline(knots, self.spline.c, self.spline.k),
            (self.start_s - offset_s) / rate,
            (self.end_s - offset_s) / rate,
        )

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        return self._along(np.asarray(time_s, float)) - self._along(np.zeros(1))[0]

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        return self.spline.derivative()(np.clip(time_s, self.start_s, self.end_s))

    def mean_hz(self, start_s: float, end_s: float) -> float:
        """Return the mean frequency of the crank between two instants (s), Hz."""
        angle = self.angle(np.array([start_s, end_s]))
        return float((angle[1] - angle[0]) / (2 * np.pi * (end_s - start_s)))

    def _along(self, time_s: np.ndarray) -> np.ndarray:
        inside = np.clip(time_s, self.start_s, self.end_s)
        return self.spline(inside) + self.speed(time_s) * (time_s - inside)
