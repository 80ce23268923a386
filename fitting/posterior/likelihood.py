"""How probable the measured gaits are: tracking noise, nuisances and the twin's own discrepancy in one covariance."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fitting.model.discrepancy import Discrepancy
from fitting.posterior.emulator import Emulator, terms

LEAST_DISCREPANCY, MOST_WAVE, MOST_SPEED = 1e-5, 1.0, 0.1  # of the twin, relative; uniform in its logarithm


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Of coefficients and the twin's relative discrepancies, for gaits of all trials in one row of length k.

    Attributes:
        measured: (k,).
        known: (k, k) covariance of noise, nuisances and emulator.
        discrepancy: what a twin does that is off by 100 %, in its wave and in its speed.
        emulator: of the simulated row.
    """

    measured: np.ndarray
    known: np.ndarray
    discrepancy: Discrepancy
    emulator: Emulator

    @cached_property
    def _spectrum(self) -> tuple[np.ndarray, np.ndarray, float]:
        """(k, k) that makes `known` the unit matrix and `discrepancy` diagonal, that diagonal, and ln det of known."""
        root = np.linalg.cholesky(self.known + 1e-18 * np.eye(len(self.known)))
        half = np.linalg.solve(root, self.discrepancy.wave)
        values, vectors = np.linalg.eigh(np.linalg.solve(root, half.T))
        return np.linalg.solve(root.T, vectors).T, np.maximum(values, 0.0), 2 * float(np.log(np.diag(root)).sum())

    @cached_property
    def _whitened(self) -> tuple[np.ndarray, np.ndarray]:
        """(t, k) weights of the emulator and (k,) measured, both freed of correlation."""
        white = self._spectrum[0]
        return self.emulator.weights @ white.T, white @ self.measured

    @cached_property
    def _speeds(self) -> np.ndarray:
        """(t, k) what the speed of each trial does, freed of correlation."""
        return (self._spectrum[0] @ self.discrepancy.speed).T

    def __call__(self, coefficients: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """(s,) ln likelihood of coefficients (s, 5) and discrepancies (s, 2), of wave and speed, by the emulator.

        Nothing is said of coefficients that no simulation was near: they count as impossible.
        """
        weights, measured = self._whitened
        columns = terms(coefficients, self.emulator.powers)
        return np.where(self.emulator.covers(columns), self._of(columns @ weights - measured, discrepancy), -np.inf)

    def of_gaits(self, gaits: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """(s,) the same of simulated gaits (s, k)."""
        return self._of((gaits - self.measured) @ self._spectrum[0].T, discrepancy)

    def covariance(self, discrepancy: np.ndarray) -> np.ndarray:
        """(k, k) of the measured row about the twin's, with discrepancies (2,) of wave and speed."""
        wave, speed = discrepancy**2
        return self.known + wave * self.discrepancy.wave + speed * self.discrepancy.speed @ self.discrepancy.speed.T

    def _of(self, white: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """The wave's discrepancy is diagonal here; the speed's is of low rank (Woodbury's identity)."""
        _, values, volume = self._spectrum
        spread = 1 + np.multiply.outer(discrepancy[:, 0] ** 2, values)  # (s, k)
        columns = self._speeds  # (t, k)
        pairs = (columns[:, None] * columns).reshape(-1, columns.shape[1])  # (t t, k)
        across = ((1 / spread) @ pairs.T).reshape(-1, len(columns), len(columns))
        seen = (white / spread) @ columns.T  # (s, t)
        inner = across + np.eye(len(columns)) / discrepancy[:, 1, None, None] ** 2
        taken = (seen * np.linalg.solve(inner, seen[..., None])[..., 0]).sum(axis=-1)
        volume = volume + np.log(spread).sum(axis=-1) + np.linalg.slogdet(inner)[1]
        volume = volume + 2 * len(columns) * np.log(discrepancy[:, 1])
        return -0.5 * ((white**2 / spread).sum(axis=-1) - taken + volume)
