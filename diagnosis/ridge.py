"""Ridge over all effects: the twin of a robot with many small effects at once.

Two swims seldom say which of many small effects there are; their sum may be determined all the same, and it is this
that moves the fish. So no effect is named here: every parameter of the catalogue is normal about zero, as wide as its
prior or narrower, all by one share, which the evidence of the fitted swims chooses in addition to a gap of no
particular cause (ridge regression, Hoerl and Kennard 1970; its width by evidence, MacKay 1992); effects that are named
keep their freedom about their fitted values. The evidence is linear about the twin with these, from features alone: how
often a tail beats is a datum of its own. Held-out swims tell whether all that forecasts better.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp

from diagnosis.constants import CALLED_FOR, SHARES, WIDER
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, refit
from fitting.signatures import Signature
from fitting.signatures.session_row import PRIOR_SD
from fitting.signatures.signature import little
from swimmer.effects import Effect, Parameter

_NONE = 1e-3  # share of the priors' widths that stands for no effect but the named ones
_LOOKS = 4  # rounds in which parameters with the wrong sign are set to zero
_GAPS_M = np.geomspace(1e-4, 0.03, 12)  # sizes of the gap of no particular cause


class RidgeFit(NamedTuple):
    """Ridge fit: the twin with all effects, the likeliest share of the priors' widths, and the log evidence gained."""

    share: float
    gained: float
    refit: Refit

    @property
    def strengths(self) -> dict[tuple[str, str], float]:
        """Strength of each parameter of each effect, in standard deviations of its prior."""
        return {(name, each.name): value / each.sd for name, each, value in self._parameters}

    @property
    def at_bound(self) -> tuple[tuple[str, str], ...]:
        """Parameters that are at a bound."""
        ends = ((name, each, value, (each.low, each.high)) for name, each, value in self._parameters)
        return tuple((name, each.name) for name, each, value, both in ends if value != 0.0 and value in both)

    @property
    def _parameters(self) -> list[tuple[str, Parameter, float]]:
        parameters = [(effect.name, parameter) for effect in self.refit.effects for parameter in effect.parameters]
        return [(*each, float(value)) for each, value in zip(parameters, self.refit.values, strict=True)]


def ridge_fit(
    linear: LinearModel, signatures: Sequence[Signature], effects: Mapping[str, Effect], named: Refit, rounds: int
) -> RidgeFit | None:
    """Fit all effects at once; None where the swims do not clearly support more than is named.

    Args:
        linear: the linearised model of the fitted swims.
        signatures: what each effect does.
        effects: the catalogue, by name.
        named: the twin with the named effects.
        rounds: steps of the refit at most.
    """
    standing = [each for each in signatures if _slopes(each) is not None]
    share, gained = likeliest_share(linear, standing, named)
    if share == _NONE or gained < CALLED_FOR:
        return None
    suited, by_name = [each.effect for each in standing], named.by_effect
    start = np.concatenate([by_name.get(e.name, np.zeros(len(e.parameters))) for e in suited])
    width = _widths(suited, named, share)
    slopes = _columns(linear, standing)
    return RidgeFit(share, gained, refit(linear, [effects[e.name] for e in suited], start, rounds, width, slopes))


def likeliest_share(linear: LinearModel, signatures: Sequence[Signature], named: Refit) -> tuple[float, float]:
    """Return the likeliest share of their priors' widths that unnamed effects have, and its log evidence gained.

    Args:
        linear: the linearised model of the fitted swims.
        signatures: what each effect does.
        named: the twin with the named effects.
    """
    effects, features = [each.effect for each in signatures], slice(None, len(linear.model.measured))
    columns, residual = _columns(linear, signatures)[features], named.residual[features]
    known, generic = linear.covariance[features, features], linear.generic[features, features]
    ridges = [_Ridge.of(known + size**2 * generic, columns, residual) for size in _GAPS_M]
    sides = np.append(np.zeros(len(PRIOR_SD)), _sides(effects, named))
    shares = (_NONE, *SHARES)
    widths = [np.append(PRIOR_SD, _widths(effects, named, share)) for share in shares]
    logs = [logsumexp([ridge.log_evidence(width, sides) for ridge in ridges]) for width in widths]
    return shares[int(np.argmax(logs))], float(logsumexp(logs[1:]) - np.log(len(SHARES)) - logs[0])


class _Ridge(NamedTuple):
    """Normal equations of columns (k, p), whitened: products (p, p) and (p,), squares of the residual, log volume."""

    gram: np.ndarray
    along: np.ndarray
    squares: float
    volume: float

    @classmethod
    def of(cls, covariance: np.ndarray, columns: np.ndarray, residual: np.ndarray) -> "_Ridge":
        """Build the normal equations from a covariance (k, k), columns (k, p) and a residual (k,)."""
        known = cho_factor(covariance, lower=True)
        solved = cho_solve(known, np.column_stack([columns, residual]))
        volume = float(np.log(np.diag(known[0])).sum())
        return cls(columns.T @ solved[:, :-1], columns.T @ solved[:, -1], float(residual @ solved[:, -1]), volume)

    def log_evidence(self, sd: np.ndarray, sides: np.ndarray) -> float:
        """Return the log evidence for strengths normal about zero, of standard deviations (p,), up to a constant.

        A strength of one sign only (`sides` 1 or -1) that would have the other is set to zero.
        """
        stands = np.ones(len(sd), bool)
        for _ in range(_LOOKS):
            along, gram = (sd * self.along)[stands], sd[stands, None] * self.gram[np.ix_(stands, stands)] * sd[stands]
            inner = np.eye(len(gram)) + gram
            strength = np.linalg.solve(inner, along)
            wrong = np.flatnonzero(stands)[strength * sides[stands] < 0]
            if not len(wrong):
                break
            stands[wrong] = False
        return float(-0.5 * (self.squares - along @ strength + np.linalg.slogdet(inner)[1]) - self.volume)


def _columns(linear: LinearModel, signatures: Sequence[Signature]) -> np.ndarray:
    """Return the Jacobian (k, 5 + p) of the row by coefficients and by small strengths of effects."""
    rows = [own for own in map(_slopes, signatures) if own is not None]
    assert len(rows) == len(signatures), "an effect that makes the twin diverge is in no twin"
    return np.vstack([linear.slopes.T, *rows]).T


def _slopes(signature: Signature) -> np.ndarray | None:
    """Return the Jacobian (p, k) by small strengths; None where the twin diverged at all strengths of a parameter."""
    slopes = [little(signature, number) for number in range(len(signature.effect.parameters))]
    rows = [slope for slope in slopes if slope is not None]
    return np.reshape(rows, (-1, signature.rows.shape[1])) if len(rows) == len(slopes) else None


def _sides(effects: Sequence[Effect], named: Refit) -> np.ndarray:
    """Return the sign (p,) of parameters of one sign; 0 for others and for named ones, which may have either."""
    signs = [
        0 if effect.name in named.by_effect else int(parameter.high > 0) - int(parameter.low < 0)
        for effect in effects
        for parameter in effect.parameters
    ]
    return np.array(signs)


def _widths(effects: Sequence[Effect], named: Refit, share: float) -> np.ndarray:
    """Return the standard deviations (p,) of all parameters."""
    shares = {effect.name: WIDER if effect.name in named.by_effect else share for effect in effects}
    return np.array([shares[effect.name] * parameter.sd for effect in effects for parameter in effect.parameters])
