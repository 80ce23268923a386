"""Named effects that do not carry over from some fitted trials to the others: leave-one-trial-out cross-validation.

Each fitted swim trial is forecast by twins that are refitted to all other data, linear about the fit to all. Where the
whole 95 % interval of the skill lies below zero, the effects forecast trials worse than the plain twin does, and the
least probable of them is withdrawn. Held-out trials are not looked at: they are opened once, to score.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from diagnosis.constants import FEWEST_TRIALS
from diagnosis.evidence import Hypotheses
from diagnosis.gap import SkillScore, skill_score
from diagnosis.linear_model import LinearModel
from diagnosis.probabilities import Probabilities
from diagnosis.refit import Refit
from diagnosis.verdict import Verdict


class Withdrawal(NamedTuple):
    """Of the most probable of a group of a verdict; its alternatives stay as probable.

    Attributes:
        effect: that was withdrawn.
        shrinkage: skill with it and what was named in addition.
        interval: 95 %.
    """

    effect: str
    shrinkage: float
    interval: tuple[float, float]


class Validated(NamedTuple):
    """A verdict after cross-validation.

    Attributes:
        verdict, probabilities: without what was withdrawn.
        best: the twin with the rest of the effects; None where none is left.
        skill: of the effects that stay, on trials left out in turn; None where nothing is named, or trials are too few.
        refutations: of what was withdrawn, in that order.
    """

    verdict: Verdict
    probabilities: Probabilities
    best: Refit | None
    skill: SkillScore | None = None
    refutations: tuple[Withdrawal, ...] = ()


def validated(
    found: Validated,
    linear: LinearModel,
    hypotheses: Hypotheses,
    refitting: Callable[[Sequence[str]], Refit],
    seed: int,
) -> Validated:
    """Withdraws names, the least probable first, for as long as they forecast trials left out worse.

    Args:
        found: before.
        linear: the fitted trials.
        hypotheses: of these.
        refitting: the twin with effects of these names.
        seed: of the draws.
    """
    if found.best is None or len(linear.swims) < FEWEST_TRIALS:
        return found
    verdict, probabilities, best, _, refutations = found
    plain = left_out(linear, Refit.plain(linear))
    while best is not None:
        skill = skill_score(plain, left_out(linear, best), linear.trial_of[linear.scored], seed)
        against = refutable(skill, best, hypotheses)
        if not against:
            return Validated(verdict, probabilities, best, skill, refutations)
        weakest = min(against, key=lambda name: probabilities.marginal[probabilities.names.index(name)])
        assert skill.value is not None
        assert skill.interval is not None
        refutations = (*refutations, Withdrawal(weakest, skill.value, skill.interval))
        probabilities = probabilities.refuted(weakest)
        verdict = verdict.without([weakest], probabilities)
        best = refitting(verdict.first) if verdict.first else None
    return Validated(verdict, probabilities, None, None, refutations)


def refutable(skill: SkillScore, best: Refit, hypotheses: Hypotheses) -> tuple[str, ...]:
    """Effects of a refitted twin one of which forecasts speak against; none where they do not.

    Never those that change frequencies: the skill leaves these out.
    """
    if skill.interval is None or skill.interval[1] >= 0:
        return ()
    return tuple(effect.name for effect in best.effects if hypotheses.shows_in_features(effect.name))


def left_out(linear: LinearModel, fit: Refit) -> np.ndarray:
    """(q,) whitened residual of all fitted swim trials, each forecast by a twin that is refitted without it."""
    covariance, corrected = linear.covariance_with_gap_in(fit.residual), np.array(fit.residual)
    point, mean = np.append(fit.at, fit.values), np.append(linear.at, np.zeros(len(fit.values)))
    for number in range(len(linear.swims)):
        own = linear.trial_of == number
        root = np.linalg.cholesky(covariance[np.ix_(~own, ~own)])
        white, columns = (solve_triangular(root, part[~own], lower=True) for part in (fit.residual, fit.slopes))
        information = columns.T @ columns + np.diag(fit.taken**-2.0)
        step = np.linalg.solve(information, columns.T @ white - (point - mean) / fit.taken**2)
        corrected[own] -= fit.slopes[own] @ (np.clip(point + step, *fit.bounds) - point)
    return linear.whitened_swims(corrected)
