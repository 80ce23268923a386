"""All effects at once, each a little: the twin of a robot with many small things amiss, and what it owes to which.

Two swims seldom say which of many small effects there are; what these do together they may say all the same, and it is
this that moves the fish. So no name is claimed here: every parameter of the catalogue is normal about none, as wide as
its prior or narrower, all by one share, which the evidence of the fitted swims chooses beside a gap of no particular
cause (ridge regression, Hoerl and Kennard 1970; its width by evidence, MacKay 1992); effects that are named keep their
freedom about what they were fitted to. The evidence is linear about the twin with these, of features alone: how often a
tail beats is a datum of its own. Held-out swims tell whether all that forecasts better.
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

_NONE = 1e-3  # share at which there is no effect but those that are named
_LOOKS = 4  # at which parameters of one sign would have the other
_GAPS_M = np.geomspace(1e-4, 0.03, 12)  # sizes of the gap of no particular cause


class RidgeFit(NamedTuple):
    """The refitted twin with all effects, the likeliest share of priors' widths, and log evidence gained over names."""

    share: float
    gained: float
    refit: Refit

    @property
    def strengths(self) -> dict[tuple[str, str], float]:
        """Of each parameter of each effect, in standard deviations of its prior."""
        return {(name, each.name): value / each.sd for name, each, value in self._parameters}

    @property
    def at_bound(self) -> tuple[tuple[str, str], ...]:
        """Parameters that are as strong as they may be."""
        ends = ((name, each, value, (each.low, each.high)) for name, each, value in self._parameters)
        return tuple((name, each.name) for name, each, value, both in ends if value != 0.0 and value in both)

    @property
    def _parameters(self) -> list[tuple[str, Parameter, float]]:
        parameters = [(effect.name, parameter) for effect in self.refit.effects for parameter in effect.parameters]
        return [(*each, float(value)) for each, value in zip(parameters, self.refit.values, strict=True)]


def ridge_fit(
    linear: LinearModel, signatures: Sequence[Signature], effects: Mapping[str, Effect], named: Refit, rounds: int
) -> RidgeFit | None:
    """None where the swims do not clearly call for more than is named."""
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
    """The likeliest share of their priors that effects have which are not named, and what all shares gain."""
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
    """Columns (k, p) beside a known covariance: (p, p) and (p,) products, whitened; squares left; ln volume."""

    gram: np.ndarray
    along: np.ndarray
    squares: float
    volume: float

    @classmethod
    def of(cls, covariance: np.ndarray, columns: np.ndarray, residual: np.ndarray) -> "_Ridge":
        """From a covariance (k, k), columns (k, p) and what is left (k,)."""
        known = cho_factor(covariance, lower=True)
        solved = cho_solve(known, np.column_stack([columns, residual]))
        volume = float(np.log(np.diag(known[0])).sum())
        return cls(columns.T @ solved[:, :-1], columns.T @ solved[:, -1], float(residual @ solved[:, -1]), volume)

    def log_evidence(self, sd: np.ndarray, sides: np.ndarray) -> float:
        """With strengths normal about none, (p,) wide; those of one side (1 or -1) that would have the other are none.

        But for what all such evidences share.
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
    """(k, 5 + p) slopes of the row with the coefficients and with little strengths of effects that stand."""
    rows = [own for own in map(_slopes, signatures) if own is not None]
    assert len(rows) == len(signatures), "an effect that makes the twin diverge is in no twin"
    return np.vstack([linear.slopes.T, *rows]).T


def _slopes(signature: Signature) -> np.ndarray | None:
    """(p, k) of little strengths; None where some parameter made the twin diverge wherever it was tried."""
    slopes = [little(signature, number) for number in range(len(signature.effect.parameters))]
    rows = [slope for slope in slopes if slope is not None]
    return np.reshape(rows, (-1, signature.rows.shape[1])) if len(rows) == len(slopes) else None


def _sides(effects: Sequence[Effect], named: Refit) -> np.ndarray:
    """(p,) 1 or -1 of parameters of one sign; 0 of others and of named ones, which are anywhere about their values."""
    signs = [
        0 if effect.name in named.by_effect else int(parameter.high > 0) - int(parameter.low < 0)
        for effect in effects
        for parameter in effect.parameters
    ]
    return np.array(signs)


def _widths(effects: Sequence[Effect], named: Refit, share: float) -> np.ndarray:
    """(p,) standard deviations of all parameters."""
    shares = {effect.name: WIDER if effect.name in named.by_effect else share for effect in effects}
    return np.array([shares[effect.name] * parameter.sd for effect in effects for parameter in effect.parameters])
