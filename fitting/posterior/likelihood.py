"""How probable the measured features are about the emulated twin, in the covariance of the mode.

Of its variance components those of the wave's discrepancy share one factor and those of the speed's another, which are
sampled with the coefficients; all others stay as large as at the mode.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fitting.model import COMPONENTS, Mode
from fitting.model.features import SPEED
from fitting.posterior.emulator import Emulator, terms

WAVE, SPEEDS = ("wave_common", "wave_own"), ("speed_common", "speed_own")
_JITTER = 1e-18  # m²


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Of coefficients and the sizes of the twin's two discrepancies, for features of all trials in one row of length k.

    Attributes:
        measured: (k,).
        known: (k, k) covariance of all but the two discrepancies, the emulator's error included.
        wave: (k, k) covariance of the wave's discrepancy, of unit size.
        speed: (k, t) columns of the speed's, of unit size.
        emulator: of the simulated row.
        ln_mean, ln_sd: (2,) of the normal priors of the ln sizes of wave and speed.
    """

    measured: np.ndarray
    known: np.ndarray
    wave: np.ndarray
    speed: np.ndarray
    emulator: Emulator
    ln_mean: np.ndarray
    ln_sd: np.ndarray

    @classmethod
    def of(cls, mode: Mode, emulator: Emulator) -> "Likelihood":
        """With the variance components of a mode."""

        def total(names: tuple[str, ...]) -> np.ndarray:
            return np.asarray(sum(mode.sizes[name] ** 2 * mode.covariance.units[name] for name in names))

        others = tuple(each.name for each in COMPONENTS if each.name not in WAVE + SPEEDS)
        known = mode.covariance.known + total(others) + emulator.error + _JITTER * np.eye(len(mode.residual))
        wave, speed = (size_of(mode, names) for names in (WAVE, SPEEDS))
        places = SPEED + len(mode.residual) // len(mode.blocks) * np.arange(len(mode.blocks))
        columns = np.zeros((len(mode.residual), len(places)))
        columns[places] = np.linalg.cholesky(total(SPEEDS)[np.ix_(places, places)]) / speed
        ln_mean, ln_sd = np.transpose([_ln_prior(mode, names) for names in (WAVE, SPEEDS)])
        return cls(mode.model.measured, known, total(WAVE) / wave**2, columns, emulator, ln_mean, ln_sd)

    @cached_property
    def _spectrum(self) -> tuple[np.ndarray, np.ndarray, float]:
        """(k, k) that makes `known` the unit matrix and `wave` diagonal, that diagonal, and ln det of known."""
        root = np.linalg.cholesky(self.known)
        half = np.linalg.solve(root, self.wave)
        values, vectors = np.linalg.eigh(np.linalg.solve(root, half.T))
        return np.linalg.solve(root.T, vectors).T, np.maximum(values, 0.0), 2 * float(np.log(np.diag(root)).sum())

    @cached_property
    def _whitened(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(t, k) weights of the emulator, (k,) measured and (t, k) columns of the speed, freed of correlation."""
        white = self._spectrum[0]
        return self.emulator.weights @ white.T, white @ self.measured, (white @ self.speed).T

    def __call__(self, coefficients: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """(s,) ln likelihood of coefficients (s, 5) and sizes (s, 2) of the wave's and the speed's discrepancy.

        Nothing is known of coefficients that no simulation was near: they count as impossible.
        """
        weights, measured, _ = self._whitened
        columns = terms(coefficients, self.emulator.powers)
        return np.where(self.emulator.covers(columns), self._of(columns @ weights - measured, sizes), -np.inf)

    def whitened(self, rows: np.ndarray) -> np.ndarray:
        """(s, k) rows of features (s, k), in which all but the two discrepancies has unit size and no correlation."""
        return np.asarray(rows @ self._spectrum[0].T)

    def of_features(self, features: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """(s,) the same of simulated features (s, k)."""
        return self._of(self.whitened(features - self.measured), sizes)

    def _of(self, white: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """The wave's discrepancy is diagonal here; the speed's is of low rank (Woodbury's identity)."""
        _, values, volume = self._spectrum
        spread = 1 + np.multiply.outer(sizes[:, 0] ** 2, values)  # (s, k)
        columns = self._whitened[2]  # (t, k)
        pairs = (columns[:, None] * columns).reshape(-1, columns.shape[1])  # (t t, k)
        across = ((1 / spread) @ pairs.T).reshape(-1, len(columns), len(columns))
        seen = (white / spread) @ columns.T  # (s, t)
        inner = across + np.eye(len(columns)) / sizes[:, 1, None, None] ** 2
        taken = (seen * np.linalg.solve(inner, seen[..., None])[..., 0]).sum(axis=-1)
        volume = volume + np.log(spread).sum(axis=-1) + np.linalg.slogdet(inner)[1]
        volume = volume + 2 * len(columns) * np.log(sizes[:, 1])
        return -0.5 * ((white**2 / spread).sum(axis=-1) - taken + volume)


def size_of(mode: Mode, names: tuple[str, ...]) -> float:
    """Root of the sum of the squares of components at the mode."""
    return float(np.sqrt(sum(mode.sizes[name] ** 2 for name in names)))


def _ln_prior(mode: Mode, names: tuple[str, ...]) -> tuple[float, float]:
    """Mean and standard deviation of ln of this size, the components in proportion as at the mode.

    It is the product of the components' own lognormal priors.
    """
    total, own = size_of(mode, names), [each for each in COMPONENTS if each.name in names]
    weights = np.array([each.ln_sd**-2 for each in own])
    means = np.log([each.median * total / mode.sizes[each.name] for each in own])
    return float(weights @ means / weights.sum()), float(weights.sum() ** -0.5)
