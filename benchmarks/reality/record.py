"""Record of a running batch, which is read off between the kept instants."""

from dataclasses import dataclass

import numpy as np

KEEP_S = 0.004  # Instants are kept at this interval.
# A simulation has blown up where a hinge bends further, or the head gets further.
_PLAUSIBLE_RAD = np.pi
_PLAUSIBLE_M = 20.0


@dataclass(frozen=True, eq=False)
class Drive:
    """The crank as a motor's log might show it, every 4 ms from the run-in to the end of its trial."""

    time_s: np.ndarray  # (k,) times since the first frame, s
    angle_rad: np.ndarray  # (k,)
    torque_n_m: np.ndarray  # (k,) torques that the tendons ask of the motor


@dataclass(frozen=True, eq=False)
class Record:
    """n simulations at k instants, evenly apart."""

    start_s: np.ndarray  # (n, 1) time of the first instant
    step_s: float  # interval between instants
    # position, velocity: (n, k, N) coordinates and their rates
    position: np.ndarray
    velocity: np.ndarray
    # crank_rad, crank_torque_n_m: (n, k)
    crank_rad: np.ndarray
    crank_torque_n_m: np.ndarray

    @property
    def lost(self) -> np.ndarray:
        """(n,) whether a simulation blew up."""
        with np.errstate(invalid="ignore"):
            bounded = (np.abs(np.diff(self.position[:, :, 2:])) < _PLAUSIBLE_RAD).all(axis=(1, 2))
            bounded &= (np.abs(self.position[:, :, :2]) < _PLAUSIBLE_M).all(axis=(1, 2))
        return ~bounded

    def coordinates(self, row: int, time_s: np.ndarray) -> np.ndarray:
        """Return (f, N) coordinates at times (f,): cubic Hermite polynomials, through places and rates."""
        where = (time_s - self.start_s[row, 0]) / self.step_s
        low = np.clip(np.floor(where).astype(int), 0, self.position.shape[1] - 2)
        t = (where - low)[:, None]
        at, rate = self.position[row], self.velocity[row] * self.step_s
        return (
            (1 + 2 * t) * (1 - t) ** 2 * at[low]
            + t * (1 - t) ** 2 * rate[low]
            + t**2 * (3 - 2 * t) * at[low + 1]
            - t**2 * (1 - t) * rate[low + 1]
        )

    def drive(self, row: int, end_s: float) -> Drive:
        """Return the crank of one simulation until just after `end_s`, however long the others of its batch go on."""
        time_s = self.start_s[row, 0] + self.step_s * np.arange(self.crank_rad.shape[1])
        own = time_s < end_s + self.step_s
        return Drive(time_s[own], self.crank_rad[row, own], self.crank_torque_n_m[row, own])
