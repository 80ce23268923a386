"""Emulator of the twin about the mode, and the likelihood of the measured features about it.

`Emulator`: polynomials in the roots of the coefficients, near the mode, with their error. Kutta lift roughens the twin
by some hundredths of a millimetre. What polynomials miss is counted as a further error of the model, with its
covariance (a nugget; Gramacy and Lee 2012), so that a sampler neither meets the roughness nor mistakes it for
knowledge. Whether a twin swims forward from rest is emulated too (`ForwardSwimming`).

`Likelihood`: in the covariance of the mode. Of the variance components those of the wave's discrepancy share one factor
and those of the speed's another, which are sampled with the coefficients; all others stay as large as at the mode.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize
from scipy.special import log_expit

from fitting.covariance import COMPONENTS
from fitting.features import SPEED
from fitting.mode import Mode
from swimcal.mjcf import COEFFICIENT_BOUNDS

_RIDGE = 1e-8  # share of the terms' mean moment that is added, so that these can be inverted
_DEGREES = (1, 2, 3, 4)  # degrees of polynomials to choose from
_SPARE = 2.5  # least ratio of points to terms: 1.6 cut the long tail of Magnus lift on the real robot short
_FARTHEST = 2.0  # largest trusted leverage; a point that the polynomials must meet has 1
# Penalty on half the squared weights: of 64 draws on the real robot none is on the wrong side; with 1e-2, two are.
_PENALTY = 1e-4
WAVE = ("wave_common", "wave_own")  # components of the wave's discrepancy
SPEEDS = ("speed_common", "speed_own")  # components of the speed's discrepancy
_JITTER = 1e-18  # m²


@dataclass(frozen=True, eq=False)
class Emulator:
    """Features as polynomials of the coefficients.

    Attributes:
        powers: (t, 5) exponents of the terms.
        weights: (t, k) of the terms in each of k numbers.
        error: (k, k) covariance of what the polynomials miss, judged on points left out one at a time.
        scatter: (t, t) root of the inverse moments of the terms over the points it was made from.
    """

    powers: np.ndarray
    weights: np.ndarray
    error: np.ndarray
    scatter: np.ndarray

    def __call__(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the features (s, k) at coefficients (s, 5)."""
        return terms(coefficients, self.powers) @ self.weights

    def leverage(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the leverage (s,) of coefficients (s, 5): small among the points it was made from, above 1 beyond."""
        return np.asarray(((terms(coefficients, self.powers) @ self.scatter) ** 2).sum(axis=1))


def fit_emulator(coefficients: np.ndarray, features: np.ndarray) -> Emulator:
    """Fit polynomials of the highest degree for which the points suffice.

    Args:
        coefficients: (s, 5) points.
        features: (s, k) features there.
    """
    degrees = [degree for degree in _DEGREES if len(exponents(degree)) * _SPARE <= len(coefficients)]
    powers = exponents(max(degrees, default=_DEGREES[0]))
    columns = terms(coefficients, powers)
    ridge = _RIDGE * np.trace(columns.T @ columns) / columns.shape[1]
    unit = np.eye(columns.shape[1])
    scatter = solve_triangular(np.linalg.cholesky(columns.T @ columns + ridge * unit), unit, lower=True).T
    weights = scatter @ (scatter.T @ (columns.T @ features))
    leverage = ((columns @ scatter) ** 2).sum(axis=1, keepdims=True)
    missed = (features - columns @ weights) / np.maximum(1 - leverage, 0.05)
    return Emulator(powers, weights, missed.T @ missed / len(missed), scatter)


def exponents(degree: int) -> np.ndarray:
    """Return the exponents (t, 5) of all products of up to `degree` coefficients."""
    rows = [
        np.bincount(np.array(chosen, int), minlength=5)
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(5), d)
    ]
    return np.array(rows)


def terms(coefficients: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """Return products (s, t) of Legendre polynomials in the roots of coefficients (s, 5), scaled to -1 to 1.

    Args:
        coefficients: (s, 5).
        powers: (t, 5) exponents.
    """
    x = 2 * np.sqrt(np.clip(coefficients, *COEFFICIENT_BOUNDS) / COEFFICIENT_BOUNDS[1]) - 1
    table = np.polynomial.legendre.legvander(x.T, int(powers.max(initial=0)))  # (5, s, d + 1)
    result = np.ones((len(x), len(powers)))
    for own, power in zip(table, powers.T, strict=True):  # gathering all five at once takes three times as long
        result *= own[:, power]
    return result


_POWERS = exponents(2)


class ForwardSwimming(NamedTuple):
    """Probability that a twin swims forward from rest: weights (t,) of terms, none where every twin did."""

    weights: np.ndarray

    @classmethod
    def of(cls, coefficients: np.ndarray, forward: np.ndarray) -> "ForwardSwimming":
        """Fit the weights to twins at coefficients (s, 5), of which some swam forward (s,)."""
        if forward.all():
            return cls(np.zeros(0))
        columns = terms(coefficients, _POWERS) * np.where(forward, 1.0, -1.0)[:, None]

        def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
            odds = columns @ weights
            slope = -columns.T @ np.exp(log_expit(-odds)) + _PENALTY * weights
            return float(0.5 * _PENALTY * weights @ weights - log_expit(odds).sum()), slope

        return cls(minimize(loss, np.zeros(len(_POWERS)), jac=True, method="L-BFGS-B").x)

    def log_probability(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the log probability (s,) at coefficients (s, 5)."""
        if not len(self.weights):
            return np.zeros(len(coefficients))
        return np.asarray(log_expit(terms(coefficients, _POWERS) @ self.weights))


# The likelihood.


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Likelihood of coefficients and the sizes of the twin's two discrepancies, for features in one row of length k.

    Attributes:
        measured: (k,) the row.
        known: (k, k) covariance of all but the two discrepancies, the emulator's error included.
        wave: (k, k) covariance of the wave's discrepancy, of unit size.
        speed: (k, t) columns of the speed's, of unit size.
        emulator: emulator of the simulated row.
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
        """Build the likelihood with the variance components of a mode."""

        def total(names: tuple[str, ...]) -> np.ndarray:
            return np.asarray(sum(mode.sizes[name] ** 2 * mode.covariance.units[name] for name in names))

        others = tuple(each.name for each in COMPONENTS if each.name not in WAVE + SPEEDS)
        known = mode.covariance.fixed + total(others) + emulator.error + _JITTER * np.eye(len(mode.residual))
        wave, speed = (size_of(mode, names) for names in (WAVE, SPEEDS))
        places = SPEED + len(mode.residual) // len(mode.blocks) * np.arange(len(mode.blocks))
        columns = np.zeros((len(mode.residual), len(places)))
        columns[places] = np.linalg.cholesky(total(SPEEDS)[np.ix_(places, places)]) / speed
        ln_mean, ln_sd = np.transpose([_ln_prior(mode, names) for names in (WAVE, SPEEDS)])
        return cls(mode.model.measured, known, total(WAVE) / wave**2, columns, emulator, ln_mean, ln_sd)

    @cached_property
    def _spectrum(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Matrix (k, k) that makes `known` the unit matrix and `wave` diagonal, that diagonal, and ln det of known."""
        root = np.linalg.cholesky(self.known)
        half = np.linalg.solve(root, self.wave)
        values, vectors = np.linalg.eigh(np.linalg.solve(root, half.T))
        return np.linalg.solve(root.T, vectors).T, np.maximum(values, 0.0), 2 * float(np.log(np.diag(root)).sum())

    @cached_property
    def _white_parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whitened weights of the emulator (t, k), measured row (k,) and columns of the speed (t, k)."""
        white = self._spectrum[0]
        return self.emulator.weights @ white.T, white @ self.measured, (white @ self.speed).T

    def __call__(self, coefficients: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return the ln likelihood (s,) of coefficients (s, 5) and sizes (s, 2) of the two discrepancies.

        Nothing is known of coefficients that no simulation was near: they count as impossible.
        """
        weights, measured, _ = self._white_parts
        columns = terms(coefficients, self.emulator.powers)
        near = ((columns @ self.emulator.scatter) ** 2).sum(axis=1) <= _FARTHEST  # points of small leverage
        return np.where(near, self._of(columns @ weights - measured, sizes), -np.inf)

    def whitened(self, rows: np.ndarray) -> np.ndarray:
        """Whiten rows of features (s, k), so that all but the two discrepancies has unit size and no correlation."""
        return np.asarray(rows @ self._spectrum[0].T)

    def of_features(self, features: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return the ln likelihood (s,) of simulated features.

        Args:
            features: (s, k).
            sizes: (s, 2) sizes of the wave's and the speed's discrepancy.
        """
        return self._of(self.whitened(features - self.measured), sizes)

    def _of(self, white: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return the ln likelihood of whitened residuals.

        The wave's discrepancy is diagonal here; the speed's is of low rank (Woodbury's identity).
        """
        _, values, volume = self._spectrum
        spread = 1 + np.multiply.outer(sizes[:, 0] ** 2, values)  # (s, k)
        columns = self._white_parts[2]  # (t, k)
        pairs = (columns[:, None] * columns).reshape(-1, columns.shape[1])  # (t t, k)
        across = ((1 / spread) @ pairs.T).reshape(-1, len(columns), len(columns))
        seen = (white / spread) @ columns.T  # (s, t)
        inner = across + np.eye(len(columns)) / sizes[:, 1, None, None] ** 2
        taken = (seen * np.linalg.solve(inner, seen[..., None])[..., 0]).sum(axis=-1)
        volume = volume + np.log(spread).sum(axis=-1) + np.linalg.slogdet(inner)[1]
        volume = volume + 2 * len(columns) * np.log(sizes[:, 1])
        return -0.5 * ((white**2 / spread).sum(axis=-1) - taken + volume)


def size_of(mode: Mode, names: tuple[str, ...]) -> float:
    """Return the root of the sum of the squares of components at the mode."""
    return float(np.sqrt(sum(mode.sizes[name] ** 2 for name in names)))


def _ln_prior(mode: Mode, names: tuple[str, ...]) -> tuple[float, float]:
    """Return the mean and standard deviation of ln of this size, the components in proportion as at the mode.

    It is the product of the components' own lognormal priors.
    """
    total, own = size_of(mode, names), [each for each in COMPONENTS if each.name in names]
    weights = np.array([each.ln_sd**-2 for each in own])
    means = np.log([each.median * total / mode.sizes[each.name] for each in own])
    return float(weights @ means / weights.sum()), float(weights.sum() ** -0.5)
