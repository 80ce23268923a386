"""A trial in few numbers that hold what it says of the fluid: how fast it cruises, and how every marker beats.

Where the fish is, where it heads and how its course bends are nuisances of a trial: they are taken out as a smooth pose
(a heading quadratic in time, a path cubic in time), in the same way of tracks and of simulations. What is left is the
forward speed, and each marker's mean and first harmonics in the frame that cruises with the fish.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fitting.trial import MeasuredTrial

HARMONICS = 3
PATH_DEGREE, HEADING_DEGREE = 3, 2
SPEED = 0  # place of the forward speed in a summary; the markers follow
OF_A_MARKER = 1 + 2 * HARMONICS  # mean, then cosine and sine of each harmonic, for x and then for y
_SHARE_OF_FRAMES = 0.5  # that a marker must be seen in to carry the path


@dataclass(frozen=True, eq=False)
class Gait:
    """Reads gaits off marker positions in the frames of one trial that are compared.

    A gait is (1 + 14 m,): forward speed (m/s), then (m, 2, 7) for each marker, along and across the fish, its mean and
    the cosines and sines of three harmonics of the crank's turn since time 0 (m).

    Attributes:
        time_s: (n,) of the frames.
        turn_rad: (n,) of the crank since time 0.
        usable: (n, m) samples that count.
        nose, neck: their places among the markers.
    """

    time_s: np.ndarray
    turn_rad: np.ndarray
    usable: np.ndarray
    nose: int
    neck: int

    @classmethod
    def of(cls, trial: MeasuredTrial) -> "Gait":
        """The reader for a trial."""
        time_s = trial.time_s[trial.kept]
        turn_rad = trial.crank_rad(time_s, trial.frequency.hz)
        usable = (trial.weight[trial.kept] > 0) & np.isfinite(trial.position_m[trial.kept]).all(axis=-1)
        return cls(time_s, turn_rad, usable, trial.markers.index("nose"), trial.markers.index("neck"))

    def __call__(self, position_m: np.ndarray) -> np.ndarray:
        """(..., 1 + 14 m) gaits of positions (..., n, m, 2); what does not count may be nan."""
        flat = position_m.reshape(-1, *position_m.shape[-3:])
        trend = self._heading(flat)  # (s, n)
        place = self._along(flat, trend)  # (s, n, m)
        path = self._path(place)  # (s, n)
        beats = np.einsum("mcn,snm->smc", self._beat, place - path[..., None])  # (s, m, 7)
        speed = np.gradient(path, self.time_s, axis=-1) + 1j * np.gradient(trend, self.time_s, axis=-1) * path
        parts = np.stack([beats.real, beats.imag], axis=2)  # (s, m, 2, 7)
        gait = np.concatenate([speed.real.mean(axis=-1)[:, None], parts.reshape(len(parts), -1)], axis=1)
        return gait.reshape(*position_m.shape[:-3], gait.shape[-1])

    @cached_property
    def _scaled(self) -> np.ndarray:
        """(n,) time from -1 to 1."""
        return 2 * (self.time_s - self.time_s[0]) / (self.time_s[-1] - self.time_s[0]) - 1

    @cached_property
    def waves(self) -> np.ndarray:
        """(n, 6) cosine and sine of each harmonic."""
        return waves(self.turn_rad, HARMONICS)

    @cached_property
    def _beat(self) -> np.ndarray:
        """(m, 7, n) reads mean and harmonics off each marker, beside what a trend that is a little off leaves."""
        means = np.column_stack([np.ones(len(self.time_s)), self.waves])
        trends = np.column_stack([self._scaled**k - np.mean(self._scaled**k) for k in range(1, HEADING_DEGREE + 1)])
        return _readers(np.column_stack([means, trends]), self.usable)[:, :OF_A_MARKER]

    @cached_property
    def _powers(self) -> np.ndarray:
        """(m, 4, n) reads the powers of scaled time off each marker."""
        columns = np.column_stack([self._scaled**k for k in range(PATH_DEGREE + 1)] + [self.waves])
        return _readers(columns, self.usable)[:, : PATH_DEGREE + 1]

    @cached_property
    def carriers(self) -> np.ndarray:
        """(m,) share of each marker in the path."""
        seen = self.usable.mean(axis=0) >= _SHARE_OF_FRAMES
        seen = seen if seen.any() else np.ones_like(seen)
        return seen / seen.sum()

    @cached_property
    def speed_reader(self) -> np.ndarray:
        """(m, n) by how much a shift of each sample along the fish raises its mean speed, 1/s."""
        rates = np.array([np.mean(np.gradient(self._scaled**k, self.time_s)) for k in range(PATH_DEGREE + 1)])
        return self.carriers[:, None] * np.einsum("c,mcn->mn", rates, self._powers)

    @property
    def beat_reader(self) -> np.ndarray:
        """(m, 7, n) by how much a shift of each sample changes each marker's mean and harmonics."""
        return self._beat

    def _along(self, position_m: np.ndarray, trend_rad: np.ndarray) -> np.ndarray:
        """(s, n, m) places from the middle of the swim, x + i y, along headings (s, n); 0 where nothing counts."""
        place = np.where(self.usable, _complex(position_m), 0.0)
        middle = place.sum(axis=(1, 2), keepdims=True) / self.usable.sum()
        return np.where(self.usable, (place - middle) * np.exp(-1j * trend_rad)[..., None], 0.0)

    def _path(self, place: np.ndarray) -> np.ndarray:
        """(s, n) the smooth path of the middle of the markers at places (s, n, m), x + i y along the heading.

        Along the heading, for there a beat stays a beat while the fish turns, and does not pass for a drift.
        """
        powers = np.einsum("m,mcn,snm->sc", self.carriers, self._powers, place)
        return powers @ np.array([self._scaled**k for k in range(PATH_DEGREE + 1)])

    def _heading(self, position_m: np.ndarray) -> np.ndarray:
        """(s, n) smooth heading from neck to nose, rad, of positions (s, n, m, 2)."""
        seen = self.usable[:, self.nose] & self.usable[:, self.neck]
        axis = _complex(position_m[:, seen, self.nose] - position_m[:, seen, self.neck])  # (s, k)
        columns = np.column_stack([self._scaled**k for k in range(HEADING_DEGREE + 1)] + [self.waves])
        found = np.unwrap(np.angle(axis), axis=-1) @ np.linalg.pinv(columns[seen]).T
        return found[:, : HEADING_DEGREE + 1] @ columns[:, : HEADING_DEGREE + 1].T


def waves(turn_rad: np.ndarray, harmonics: int) -> np.ndarray:
    """(n, 2 h) cosine and sine of each harmonic of a turn (n,)."""
    return np.stack([wave(k * turn_rad) for k in range(1, harmonics + 1) for wave in (np.cos, np.sin)], axis=1)


def harmonics_of(gait: np.ndarray) -> np.ndarray:
    """(..., m, 2, 3) complex harmonics a - i b of gaits (..., 1 + 14 m): place = Re(harmonic exp(i h turn))."""
    beats = gait[..., 1:].reshape(*gait.shape[:-1], -1, 2, OF_A_MARKER)
    return beats[..., 1::2] - 1j * beats[..., 2::2]


def advanced(gait: np.ndarray, phase_rad: ArrayLike) -> np.ndarray:
    """Gaits (..., 1 + 14 m) of the same swim with the crank ahead by an angle (...,)."""
    turned = (
        harmonics_of(gait) * np.exp(1j * np.multiply.outer(phase_rad, np.arange(1, HARMONICS + 1)))[..., None, None, :]
    )
    result = np.array(gait)
    beats = result[..., 1:].reshape(*gait.shape[:-1], -1, 2, OF_A_MARKER)
    beats[..., 1::2], beats[..., 2::2] = turned.real, -turned.imag
    result[..., 1:] = beats.reshape(*gait.shape[:-1], -1)
    return result


def phase_between(gait: np.ndarray, measured: np.ndarray, tail: list[int]) -> np.ndarray:
    """(...,) by how much gaits (..., k) must be advanced for their tails to beat in step with a measured one (k,)."""
    simulated, seen = (harmonics_of(part)[..., 0][..., tail, :] for part in (gait, measured))
    return np.angle((simulated.conj() * seen).sum(axis=(-2, -1)))


def _readers(columns: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """(m, c, n) least squares on columns (n, c) over the usable samples (n, m) of each marker."""
    return np.stack([np.linalg.pinv(np.where(seen[:, None], columns, 0.0)) for seen in usable.T])


def _complex(position_m: np.ndarray) -> np.ndarray:
    return position_m[..., 0] + 1j * position_m[..., 1]
