"""All effects at once, each a little: the twin of a robot with many small things amiss.

Two swims seldom say which of many small effects there are; what these do together they may say all the same, and it is
this that moves the fish. So no name is claimed here: every parameter of the catalogue is normal about none, as wide as
its prior or narrower, all by one share, which the evidence of the fitted swims chooses beside a gap of no particular
cause (ridge regression, Hoerl and Kennard 1970; its width by evidence, MacKay 1992); effects that are named keep their
freedom. Held-out swims tell whether that forecasts better.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from diagnosis.ground import Ground
from diagnosis.refit import WIDER, Refit, refit
from fitting.signatures import Signature
from fitting.signatures.session_row import PRIOR_SD
from fitting.signatures.slopes import little
from swimmer.effects import Effect

SHARES = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
CLEARLY = 10.0
"""Log evidence that all effects have to gain beside those that are named."""
_NONE = 1e-3  # share at which there is no effect but those that are named
_GAPS_M = np.geomspace(1e-4, 0.03, 12)  # sizes of the gap of no particular cause


class Everything(NamedTuple):
    """The refitted twin with all effects.

    Attributes:
        share: of the width of their priors that those have which are not named.
        gained: by the fitted swims, log evidence against that with the named effects alone.
        refit: the twin.
    """

    share: float
    gained: float
    refit: Refit

    @property
    def strengths(self) -> dict[tuple[str, str], float]:
        """Of each parameter of each effect, in standard deviations of its prior."""
        parameters = [(effect.name, parameter) for effect in self.refit.effects for parameter in effect.parameters]
        told = zip(parameters, self.refit.values, strict=True)
        return {(name, parameter.name): float(value / parameter.sd) for (name, parameter), value in told}


def everything(
    ground: Ground, signatures: Sequence[Signature], effects: Mapping[str, Effect], named: Refit | None, rounds: int
) -> Everything | None:
    """None where the swims do not clearly call for more than is named.

    Args:
        ground: the fitted swims beside the nearest plain twin.
        signatures: of the catalogue.
        effects: the catalogue; what makes the twin diverge is left out.
        named: the twin with the named effects; None where none is.
        rounds: steps at most.
    """
    standing = [each for each in signatures if _slopes(each) is not None]
    by_name = {} if named is None else named.by_effect
    share, gained = likeliest_share(ground, standing, by_name)
    if share == _NONE or gained < CLEARLY:
        return None
    suited = [each.effect for each in standing]
    start = np.concatenate([by_name.get(e.name, np.zeros(len(e.parameters))) for e in suited])
    width = _widths(suited, by_name, share)
    return Everything(share, gained, refit(ground, [effects[e.name] for e in suited], start, rounds, width))


def likeliest_share(ground: Ground, signatures: Sequence[Signature], named: Collection[str]) -> tuple[float, float]:
    """The share of its prior that all effects but the named have, and what it gains; linear about the plain twin."""
    told = [rows for rows in map(_slopes, signatures) if rows is not None]
    effects = [each.effect for each in signatures]
    columns = np.vstack([ground.slopes.T, *told]).T
    gaits = slice(None, len(ground.model.measured))
    logs = np.empty((len(_GAPS_M), 1 + len(SHARES)))
    for row, size in enumerate(_GAPS_M):
        covariance = np.array(ground.covariance)
        covariance[gaits, gaits] += size**2 * ground.generic[gaits, gaits]
        known = cho_factor(covariance, lower=True)
        solved = cho_solve(known, np.column_stack([columns, ground.left]))
        gram, along, squares = columns.T @ solved[:, :-1], columns.T @ solved[:, -1], ground.left @ solved[:, -1]
        volume = float(np.log(np.diag(known[0])).sum())
        for column, share in enumerate((_NONE, *SHARES)):
            sd = np.append(PRIOR_SD, _widths(effects, named, share))
            inner = np.eye(len(sd)) + sd[:, None] * gram * sd
            fitted = (sd * along) @ np.linalg.solve(inner, sd * along)
            logs[row, column] = -0.5 * (squares - fitted + np.linalg.slogdet(inner)[1]) - volume
    of_shares = np.logaddexp.reduce(logs, axis=0)
    best = int(np.argmax(of_shares))
    return (_NONE, *SHARES)[best], float(of_shares[best] - of_shares[0])


def _slopes(signature: Signature) -> np.ndarray | None:
    """(p, k) of little strengths; None where some parameter made the twin diverge wherever it was tried."""
    slopes = [little(signature, number) for number in range(len(signature.effect.parameters))]
    rows = [slope for slope in slopes if slope is not None]
    return np.reshape(rows, (-1, signature.rows.shape[1])) if len(rows) == len(slopes) else None


def _widths(effects: Sequence[Effect], named: Collection[str], share: float) -> np.ndarray:
    """(p,) standard deviations of all parameters."""
    each = [
        (WIDER if effect.name in named else share, parameter) for effect in effects for parameter in effect.parameters
    ]
    return np.array([width * parameter.sd for width, parameter in each])
