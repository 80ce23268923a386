"""Effects that act together are weighed linear about the plain twin; here each must hold against the real simulation.

Two strong effects together do what neither slope says, and a third name may stand for just that. So the twin is
refitted without each in turn, and a name goes whose twin is no likelier with it than without (Laplace's evidence;
MacKay 2003, chapter 28). What is little beside the others may also be what their forms have wrong, and no effect: so
it is no surer than that leaves room for.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from diagnosis.evidence import Belief
from diagnosis.ground import Ground
from diagnosis.refit import Refit
from diagnosis.sized import LITTLE, MOST_WRONG
from fitting.signatures.session_row import PRIOR_SD
from swimmer.effects import Effect

_SILENT = 1e-9
Refitting = Callable[[Sequence[Effect]], Refit]


class Pruned(NamedTuple):
    """What stands against the real simulation.

    Attributes:
        best: the twin with the effects that do.
        gone: log odds of each effect that does not, against the twin without it; at most 0.
        kept: the same of each effect that does, where there are several.
    """

    best: Refit
    gone: dict[str, float]
    kept: dict[str, float]


def pruned(ground: Ground, best: Refit, refitting: Refitting, belief: Belief, catalogue: int) -> Pruned:
    """The twin with as many of its effects as the swims call for; at least one.

    Args:
        ground: the fitted swims.
        best: with all of the effects.
        refitting: with some of them.
        belief: before the session.
        catalogue: number of effects that there are.
    """
    gone: dict[str, float] = {}
    while len(best.effects) > 1:
        fewer = [refitting([effect for effect in best.effects if effect is not without]) for without in best.effects]
        against = np.array([log_odds(ground, best, each, belief, catalogue) for each in fewer])
        least = int(np.argmin(against))
        if against[least] > 0:
            return Pruned(best, gone, dict(zip((each.name for each in best.effects), against.tolist(), strict=True)))
        gone[best.effects[least].name] = float(against[least])
        best = fewer[least]
    return Pruned(best, gone, {})


def log_odds(ground: Ground, fit: Refit, without: Refit, belief: Belief, catalogue: int) -> float:
    """Of the one effect that a refitted twin has and another lacks.

    What it does may be what the forms of the others have wrong instead, which is as large as a share of what those do.
    """
    (effect,) = (each for each in fit.effects if each.name not in without.by_effect)
    wrong = _imitated(ground, fit, without, effect) + np.log(belief.alike / catalogue)
    right = log_evidence(ground, without) + np.log1p(-belief.alike)
    lost = belief.log_prior(len(without.effects), False, catalogue)
    return log_weight(ground, fit, belief, catalogue) - float(np.logaddexp(wrong, right)) - lost


def _imitated(ground: Ground, fit: Refit, without: Refit, effect: Effect) -> float:
    """Log evidence of a refitted twin in which one effect stands for what the forms of the others have wrong."""
    does, others = (
        float(np.linalg.norm(_white(ground, moved))) for moved in (fit.left - without.left, without.left - ground.left)
    )
    shares = [share * min(others, MOST_WRONG) / max(does, _SILENT) for share in LITTLE]
    return float(logsumexp([log_evidence(ground, fit, {effect.name: share}) for share in shares]) - np.log(len(shares)))


def log_weight(ground: Ground, fit: Refit, belief: Belief, catalogue: int) -> float:
    """Log evidence of a refitted twin and log prior of so many effects, but for what all twins share."""
    return log_evidence(ground, fit) + belief.log_prior(len(fit.effects), False, catalogue)


def log_evidence(ground: Ground, fit: Refit, narrowed: Mapping[str, float] | None = None) -> float:
    """Of a refitted twin by Laplace's approximation, but for what all twins share.

    What is left is normal, of a size that suits it. The prior of a parameter is as wide as the effect has it, or wider
    where the effect is stronger than that, all of its parameters by the same factor: one of which the swims say
    nothing costs nothing and gains nothing.

    Args:
        ground: the fitted swims.
        fit: the twin.
        narrowed: effects by name whose prior is instead as wide as this multiple of how strong they are.
    """
    narrowed, space = narrowed or {}, ground.with_gap_in(fit.left)
    white = solve_triangular(space.root, fit.left, lower=True)
    widths = [_widths(effect, fit.by_effect[effect.name], narrowed.get(effect.name)) for effect in fit.effects]
    width = np.concatenate([PRIOR_SD, *widths])
    off = np.concatenate([fit.at - ground.at, fit.values]) / width
    volume = -0.5 * float(np.linalg.slogdet(fit.precision(width))[1]) - float(np.log(width).sum())
    likelihood = -0.5 * float(white @ white) - float(np.log(np.diag(space.root)).sum())
    return likelihood - 0.5 * float(off @ off) + volume


def _widths(effect: Effect, values: np.ndarray, multiple: float | None) -> np.ndarray:
    """(p,) of the prior of each parameter."""
    sd = np.array([parameter.sd for parameter in effect.parameters])
    strength = float(np.sqrt(np.mean((values / sd) ** 2)))
    return np.asarray(sd * (max(1.0, strength) if multiple is None else max(multiple * strength, _SILENT)))


def _white(ground: Ground, row: np.ndarray) -> np.ndarray:
    return np.asarray(solve_triangular(ground.space.root, row, lower=True))
