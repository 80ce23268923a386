"""Effects that act together are weighed linear about the plain twin; here each must hold against the real simulation.

Two strong effects together do what neither slope says, and a third name may stand for just that. So the twin is
refitted without each in turn, and a name goes that is not likely enough to be said beside the others (Laplace's
evidence; MacKay 2003, chapter 28). What is little beside the others may also be what their forms have wrong, and no
effect: so it is no surer than that leaves room for.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logit

from diagnosis.constants import HELD, LITTLE, MOST_WRONG
from diagnosis.evidence import Priors
from diagnosis.ground import Ground
from diagnosis.refit import Refit, left_at
from fitting.signatures.session_row import PRIOR_SD
from swimmer.effects import Effect

_SILENT = 1e-9  # whitened length of nothing
_LEAST_WIDTH = 1e-6  # of a prior, in standard deviations of the effect's own
Refitting = Callable[[Sequence[str]], Refit]


class Pruned(NamedTuple):
    """What stands against the real simulation.

    Attributes:
        best: the twin with the effects that do.
        gone: log odds of each effect that does not, beside those that were there with it; the first to go first.
        kept: of each effect that does, where there are several, beside the others.
    """

    best: Refit
    gone: dict[str, float]
    kept: dict[str, float]


def pruned(ground: Ground, best: Refit, refitting: Refitting, priors: Priors, catalogue: int) -> Pruned:
    """The twin with as many of its effects as the swims call for; at least one.

    Args:
        ground: the fitted swims.
        best: with all of the effects.
        refitting: with some of them, by their names.
        priors: before the session.
        catalogue: number of effects that there are.
    """
    least = float(logit(HELD * (1 + priors.imitated)))  # what is there may be something that only looks like it
    gone: dict[str, float] = {}
    while len(best.effects) > 1:
        names = [effect.name for effect in best.effects]
        fewer = [refitting([name for name in names if name != without]) for without in names]
        odds = log_odds(ground, best, fewer, priors, catalogue)
        weakest = int(np.argmin(odds))
        if odds[weakest] > least:
            return Pruned(best, gone, dict(zip(names, odds.tolist(), strict=True)))
        gone[names[weakest]] = float(odds[weakest])
        best = fewer[weakest]
    return Pruned(best, gone, {})


def log_odds(ground: Ground, fit: Refit, fewer: Sequence[Refit], priors: Priors, catalogue: int) -> np.ndarray:
    """(e,) of each effect of a refitted twin, against that twin without it.

    What an effect does may also be what the forms of the others have wrong, which looks like a little of any effect.

    Args:
        ground: the fitted swims.
        fit: with e effects, at least two.
        fewer: e twins, each refitted without one of them.
        priors: before the session.
        catalogue: number of effects that there are.
    """
    count, alike = len(fit.effects), priors.alike / catalogue
    prior = priors.log_prior(count, False, catalogue) - priors.log_prior(count - 1, False, catalogue)
    together, found = log_evidence(ground, fit) + prior, []
    for effect, without, room in zip(fit.effects, fewer, _room(ground, fit), strict=True):
        wrong = [log_evidence(ground, fit, {effect.name: share * room}) for share in LITTLE]
        wrong_form = np.logaddexp.reduce(wrong) - np.log(len(wrong)) + np.log(alike)
        found.append(together - np.logaddexp(log_evidence(ground, without) + np.log1p(-alike), wrong_form))
    return np.array(found)


def _room(ground: Ground, fit: Refit) -> np.ndarray:
    """(e,) length of what the other effects do, of which a share may be wrong, over that of what each effect does.

    The others before coefficients are refitted, up to a limit, and each after that: as `diagnosis.sized` has it.
    """
    ends = np.cumsum([0, *(len(effect.parameters) for effect in fit.effects)])
    values = np.tile(fit.values, (len(fit.effects) + 1, 1))
    values[0] = 0.0
    for row, (begin, end) in enumerate(pairwise(ends), start=1):
        values[row, begin:end] = 0.0
    nothing, *without = left_at(ground, fit, values)
    return np.array([_others(ground, nothing - row) / max(_does(ground, row - fit.left), _SILENT) for row in without])


def _others(ground: Ground, moved: np.ndarray) -> float:
    """Whitened length, at most the limit; as long as that where a twin diverged."""
    if not np.isfinite(moved).all():
        return MOST_WRONG
    return min(float(np.linalg.norm(ground.whitened(moved))), MOST_WRONG)


def _does(ground: Ground, moved: np.ndarray) -> float:
    """Whitened length, coefficients refitted; infinite where the twin diverges without the effect."""
    return ground.space.length(moved) if np.isfinite(moved).all() else np.inf


def log_evidence(ground: Ground, fit: Refit, narrowed: Mapping[str, float] | None = None) -> float:
    """Of a refitted twin by Laplace's approximation, but for what all twins share.

    What is left is normal, of a size that suits it. The prior of a parameter is as wide as the effect has it, or wider
    where the effect is stronger than that, all of its parameters by the same factor: one of which the swims say
    nothing costs nothing and gains nothing. Where a prior is narrower than the one beside which the twin was fitted,
    the likeliest point moves towards none: linear.

    Args:
        ground: the fitted swims.
        fit: the twin.
        narrowed: effects by name whose prior is instead as wide as this multiple of how strong they are, or their own.
    """
    narrowed, space = narrowed or {}, ground.with_gap_in(fit.left)
    white = solve_triangular(space.root, fit.left, lower=True)
    widths = [_widths(effect, fit.by_effect[effect.name], narrowed.get(effect.name)) for effect in fit.effects]
    width = np.concatenate([PRIOR_SD, *widths])
    off, precision = np.concatenate([fit.at - ground.at, fit.values]), fit.precision(width)
    pull = (width**-2.0 - fit.taken**-2.0) * off
    volume = -0.5 * float(np.linalg.slogdet(precision)[1]) - float(np.log(width).sum())
    likelihood = -0.5 * float(white @ white) - float(np.log(np.diag(space.root)).sum())
    return likelihood + volume - 0.5 * float((off / width) @ (off / width) - pull @ np.linalg.solve(precision, pull))


def _widths(effect: Effect, values: np.ndarray, multiple: float | None) -> np.ndarray:
    """(p,) of the prior of each parameter."""
    sd = np.array([parameter.sd for parameter in effect.parameters])
    strength = float(np.sqrt(np.mean((values / sd) ** 2)))
    own = max(1.0, strength)
    return np.asarray(sd * (own if multiple is None else np.clip(multiple * strength, _LEAST_WIDTH, own)))
