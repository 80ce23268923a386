"""Effects that act together are weighed linear about the plain twin; here each must hold against the real simulation.

Two strong effects together do what neither slope says, and a third name may stand for just that. So the twin is
refitted without each in turn, and a name goes whose twin is no likelier with it than without (Laplace's evidence;
MacKay 2003, chapter 28).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from diagnosis.evidence import Belief
from diagnosis.ground import Ground
from diagnosis.refit import Refit
from fitting.signatures.session_row import PRIOR_SD
from swimmer.effects import Effect

Refitting = Callable[[Sequence[Effect]], Refit]


class Pruned(NamedTuple):
    """What stands against the real simulation.

    Attributes:
        best: the twin with the effects that do.
        log_odds: of each effect that does not, against the twin without it; at most 0.
    """

    best: Refit
    log_odds: dict[str, float]


def pruned(ground: Ground, best: Refit, refitting: Refitting, belief: Belief, catalogue: int) -> Pruned:
    """The twin with as many of its effects as the swims call for; at least one.

    Args:
        ground: the fitted swims.
        best: with all of the effects.
        refitting: with some of them.
        belief: before the session.
        catalogue: number of effects that there are.
    """
    log_odds: dict[str, float] = {}
    while len(best.effects) > 1:
        fewer = [refitting([effect for effect in best.effects if effect is not without]) for without in best.effects]
        weights = [log_weight(ground, each, belief, catalogue) for each in fewer]
        likeliest = int(np.argmax(weights))
        against = log_weight(ground, best, belief, catalogue) - weights[likeliest]
        if against > 0:
            break
        log_odds[best.effects[likeliest].name] = against
        best = fewer[likeliest]
    return Pruned(best, log_odds)


def log_weight(ground: Ground, fit: Refit, belief: Belief, catalogue: int) -> float:
    """Log evidence of a refitted twin and log prior of so many effects, but for what all twins share."""
    return log_evidence(ground, fit) + belief.log_prior(len(fit.effects), False, catalogue)


def log_evidence(ground: Ground, fit: Refit) -> float:
    """Of a refitted twin by Laplace's approximation, but for what all twins share.

    What is left is normal, of a size that suits it. The prior of a parameter is as wide as the effect has it, or wider
    where the effect is stronger than that, all of its parameters by the same factor: one of which the swims say
    nothing costs nothing and gains nothing.
    """
    space = ground.with_gap_in(fit.left)
    white = solve_triangular(space.root, fit.left, lower=True)
    width = np.concatenate([PRIOR_SD, *(_widths(effect, fit.by_effect[effect.name]) for effect in fit.effects)])
    off = np.concatenate([fit.at - ground.at, fit.values]) / width
    volume = -0.5 * float(np.linalg.slogdet(fit.precision(width))[1]) - float(np.log(width).sum())
    likelihood = -0.5 * float(white @ white) - float(np.log(np.diag(space.root)).sum())
    return likelihood - 0.5 * float(off @ off) + volume


def _widths(effect: Effect, values: np.ndarray) -> np.ndarray:
    """(p,) of the prior of each parameter."""
    sd = np.array([parameter.sd for parameter in effect.parameters])
    return np.asarray(sd * max(1.0, float(np.sqrt(np.mean((values / sd) ** 2)))))
