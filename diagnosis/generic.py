"""Gaussian-process discrepancy: how features would differ under a gap of no particular cause, of unknown size.

Displacements of a marker are correlated with those of its neighbours along the body, less so the further they are, and
the higher a harmonic is the smaller they are; each trial has its own. The differences of frequencies from their
commands have their own size, and so have free decays: a clock that is wrong says nothing of how the fish swims.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from diagnosis.constants import (
    COURSE_PER_M,
    HERTZ_PER_M,
    RING_PER_M,
    SLIDE_PER_M,
    SPEED_PER_M,
)
from fitting.model.features import COURSE, OF_A_MARKER, SLIDES, SPEED
from fitting.model.variance import along_body, harmonic_decay

_SIZES_M = (1e-6, 0.05)  # ends of the sizes tried for features and free decays
_HERTZ_SIZES_M = (1e-6, 1.0)  # ends of the sizes tried for frequencies
_SIZES_TRIED = 60


def generic_covariance(along_m: np.ndarray, trials: int, frequencies: int, rings: int = 0) -> np.ndarray:
    """Return the covariance (k, k) of a gap with displacements of one metre.

    Args:
        along_m: (m,) place of each marker on the straight robot, m.
        trials: number of trials.
        frequencies: number of frequencies.
        rings: number of numbers from free decays.
    """
    between, of_beat = along_body(along_m), np.diag(np.append(1.0, harmonic_decay()) ** 2)
    assert len(of_beat) == OF_A_MARKER
    markers = np.kron(between, np.kron(np.eye(2), of_beat))  # (14 m, 14 m)
    assert SPEED == 0
    assert len(COURSE_PER_M) == len(COURSE)
    slides = SLIDE_PER_M**2 * between[:SLIDES, :SLIDES]
    features = block_diag([[SPEED_PER_M**2]], markers, slides, np.diag(np.square(COURSE_PER_M)))
    return block_diag(*[features] * trials, HERTZ_PER_M**2 * np.eye(frequencies), RING_PER_M**2 * np.eye(rings))


@dataclass(frozen=True, eq=False)
class GaussianProcessDiscrepancy:
    """A gap of no particular cause, in addition to what is known of a row.

    Attributes:
        known: (k, k) covariance of what is known.
        generic: (k, k) covariance of a gap of one metre.
        frequencies: number of frequencies behind the features.
        rings: number of numbers from free decays, at the row's end.
    """

    known: np.ndarray
    generic: np.ndarray
    frequencies: int
    rings: int = 0

    def covariance(self, residual: np.ndarray) -> np.ndarray:
        """Return the covariance (k, k) at the likeliest sizes of features, frequencies and decays.

        The sizes are those in a residual (k,).
        """
        parts = [
            beside.likeliest_m(residual[own], ends) ** 2 * self.generic[own, own]
            for own, beside, ends in zip(
                self._parts, self._decompositions, (_SIZES_M, _HERTZ_SIZES_M, _SIZES_M), strict=True
            )
            if beside is not None
        ]
        return np.asarray(block_diag(*parts))

    @property
    def _parts(self) -> tuple[slice, ...]:
        whole = len(self.generic)
        ends = (0, whole - self.rings - self.frequencies, whole - self.rings, whole)
        return tuple(slice(*both) for both in pairwise(ends))

    @cached_property
    def _decompositions(self) -> "tuple[_KnownAndGeneric | None, ...]":
        squares = ((self.known[own, own], self.generic[own, own]) for own in self._parts)
        return tuple(_KnownAndGeneric.of(known, generic) if len(known) else None for known, generic in squares)


class _KnownAndGeneric(NamedTuple):
    """Root (k, k) of the known covariance, and variances (k,) and directions (k, k) of a whitened gap of one metre."""

    root: np.ndarray
    values: np.ndarray
    vectors: np.ndarray

    @classmethod
    def of(cls, known: np.ndarray, generic: np.ndarray) -> "_KnownAndGeneric":
        """Decompose the covariances (k, k) of what is known and of a gap of one metre."""
        root = np.linalg.cholesky(known)
        white = solve_triangular(root, generic, lower=True)
        values, vectors = np.linalg.eigh(solve_triangular(root, white.T, lower=True))
        return cls(root, np.maximum(values, 0.0), vectors)

    def likeliest_m(self, residual: np.ndarray, ends_m: tuple[float, float]) -> float:
        """Return the likeliest size of the gap in a residual (k,), between these ends."""
        seen = (self.vectors.T @ solve_triangular(self.root, residual, lower=True)) ** 2
        sizes = np.geomspace(*ends_m, _SIZES_TRIED)
        variance = 1 + np.outer(sizes**2, self.values)
        return float(sizes[np.argmin((seen / variance + np.log(variance)).sum(axis=1))])
