"""A gap of no particular cause: how features would differ if anything at all were amiss, of a size that is not known.

Displacements of a marker are alike to those of its neighbours along the body, less so the further they are, and the
higher a harmonic is the smaller they are; each trial has its own. How far frequencies are from their commands has a
size of its own, and so have free decays: a clock that is wrong says nothing of how the fish swims.
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

_SIZES_M, _TRIED = (1e-6, 0.05), 60
_OF_HERTZ_M = (1e-6, 1.0)


def generic_covariance(along_m: np.ndarray, trials: int, frequencies: int, rings: int = 0) -> np.ndarray:
    """(k, k) for displacements of one metre: of t swims with markers at (m,) along the body, and of the other numbers.

    Args:
        along_m: (m,) place of each marker on the straight robot, m.
        trials: t.
        frequencies: how many.
        rings: numbers of free decays.
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
    """Such a gap beside what is known of a row.

    Attributes:
        known: (k, k) covariance.
        generic: (k, k) of a gap of one metre.
        frequencies: how many the row holds behind the features.
        rings: numbers of free decays, at its end.
    """

    known: np.ndarray
    generic: np.ndarray
    frequencies: int
    rings: int = 0

    def covariance(self, residual: np.ndarray) -> np.ndarray:
        """(k, k) with the likeliest size of features, frequencies and decays, each its own, in what is left (k,)."""
        parts = [
            beside.likeliest_m(residual[own], ends) ** 2 * self.generic[own, own]
            for own, beside, ends in zip(self._parts, self._beside, (_SIZES_M, _OF_HERTZ_M, _SIZES_M), strict=True)
            if beside is not None
        ]
        return np.asarray(block_diag(*parts))

    @property
    def _parts(self) -> tuple[slice, ...]:
        whole = len(self.generic)
        ends = (0, whole - self.rings - self.frequencies, whole - self.rings, whole)
        return tuple(slice(*both) for both in pairwise(ends))

    @cached_property
    def _beside(self) -> "tuple[_KnownAndGeneric | None, ...]":
        squares = ((self.known[own, own], self.generic[own, own]) for own in self._parts)
        return tuple(_KnownAndGeneric.of(known, generic) if len(known) else None for known, generic in squares)


class _KnownAndGeneric(NamedTuple):
    """Root (k, k) of what is known; whitened by it, variances (k,) of a gap of one metre, and (k, k) along what."""

    root: np.ndarray
    values: np.ndarray
    vectors: np.ndarray

    @classmethod
    def of(cls, known: np.ndarray, generic: np.ndarray) -> "_KnownAndGeneric":
        """From covariances (k, k)."""
        root = np.linalg.cholesky(known)
        white = solve_triangular(root, generic, lower=True)
        values, vectors = np.linalg.eigh(solve_triangular(root, white.T, lower=True))
        return cls(root, np.maximum(values, 0.0), vectors)

    def likeliest_m(self, residual: np.ndarray, ends_m: tuple[float, float]) -> float:
        """The likeliest size in what is left (k,), between these ends."""
        seen = (self.vectors.T @ solve_triangular(self.root, residual, lower=True)) ** 2
        sizes = np.geomspace(*ends_m, _TRIED)
        variance = 1 + np.outer(sizes**2, self.values)
        return float(sizes[np.argmin((seen / variance + np.log(variance)).sum(axis=1))])
