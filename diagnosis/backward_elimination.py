"""Backward elimination: each of several named effects must improve the real simulation, not only the linear model.

The twin is refitted without each in turn; the weakest is removed until all that stay are likely enough to be named
(Laplace's approximation of the evidence; MacKay 2003, chapter 28).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logit

from diagnosis.constants import HELD
from diagnosis.evidence import Priors
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit
from fitting.signatures.session_row import PRIOR_SD
from swimmer.effects import Effect

Refitting = Callable[[Sequence[str]], Refit]


class Eliminated(NamedTuple):
    """The twin with the effects that stay, and the names of those that do not, in the order in which they went."""

    best: Refit
    gone: tuple[str, ...]


def backward_elimination(
    linear: LinearModel, best: Refit, refitting: Refitting, priors: Priors, catalogue: int
) -> Eliminated:
    """Keeps as many effects as the fitted trials support; at least one.

    Args:
        linear: the fitted trials.
        best: with all of the effects.
        refitting: with some of them, by their names.
        priors: before the session.
        catalogue: number of effects that there are.
    """
    least = float(logit(HELD * (1 + priors.look_alike)))
    gone: tuple[str, ...] = ()
    while (count := len(best.effects)) > 1:
        names = [effect.name for effect in best.effects]
        fewer = [refitting([name for name in names if name != without]) for without in names]
        prior = priors.log_prior(count, False, catalogue) - priors.log_prior(count - 1, False, catalogue)
        log_odds = log_evidence(linear, best) + prior - np.array([log_evidence(linear, each) for each in fewer])
        weakest = int(np.argmin(log_odds))
        if log_odds[weakest] > least:
            break
        gone, best = (*gone, names[weakest]), fewer[weakest]
    return Eliminated(best, gone)


def log_evidence(linear: LinearModel, fit: Refit) -> float:
    """Of a refitted twin, but for what all twins share.

    What is left is normal, of a size that suits it. The prior of a parameter is as wide as the effect has it, or wider
    where the effect is stronger, all of its parameters by the same factor; one that the trials do not determine costs
    nothing and gains nothing.
    """
    space = linear.with_gap_in(fit.residual)
    white = solve_triangular(space.root, fit.residual, lower=True)
    width = np.concatenate([PRIOR_SD, *(_width(effect, fit.by_effect[effect.name]) for effect in fit.effects)])
    off, precision = np.concatenate([fit.at - linear.at, fit.values]), fit.precision(width)
    pull = (width**-2.0 - fit.taken**-2.0) * off  # the likeliest point moves as the prior does
    volume = -0.5 * float(np.linalg.slogdet(precision)[1]) - float(np.log(width).sum())
    likelihood = -0.5 * float(white @ white) - float(np.log(np.diag(space.root)).sum())
    return likelihood + volume - 0.5 * float((off / width) @ (off / width) - pull @ np.linalg.solve(precision, pull))


def _width(effect: Effect, values: np.ndarray) -> np.ndarray:
    """(p,) of the prior of each parameter."""
    sd = np.array([parameter.sd for parameter in effect.parameters])
    return np.asarray(sd * max(1.0, float(np.sqrt(np.mean((values / sd) ** 2)))))
