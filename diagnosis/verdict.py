"""What may be said: a name, a few names that cannot be separated, that something else is there, or nothing.

Of several named effects those stay that the fitted trials support, and that carry over between them. Backward
elimination: the twin is refitted without each in turn, so that each must improve the real simulation, not only the
linear model; the weakest is removed until all that stay are likely enough to be named (Laplace's approximation of the
evidence; MacKay 2003, chapter 28). Leave-one-trial-out cross-validation: each fitted swim trial is forecast by twins
that are refitted to all other data, linear about the fit to all; where the whole 95 % interval of the skill lies below
zero, the least probable effect is withdrawn. Held-out trials are not looked at: they are opened once, to score.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logit

from diagnosis.constants import ALARM, BESIDE, ENOUGH, FEWEST_TRIALS, HELD, LOOKED_AT, MOST_ALIKE, MOST_GROUPS
from diagnosis.evidence import Hypotheses, Priors
from diagnosis.held_out import SkillScore, skill_score
from diagnosis.linear_model import LinearModel
from diagnosis.probabilities import Probabilities
from diagnosis.refit import Refit
from diagnosis.result import VerdictName, WithdrawnEffects
from fitting.signatures.session_row import PRIOR_SD
from swimmer.effects import Effect

Refitting = Callable[[Sequence[str]], Refit]


@dataclass(frozen=True)
class Verdict:
    """What is said: groups that act together, each of alternatives, the likeliest first."""

    name: VerdictName
    groups: tuple[tuple[str, ...], ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """All that are named, each once."""
        return tuple(dict.fromkeys(name for group in self.groups for name in group))

    @property
    def first(self) -> tuple[str, ...]:
        """The likeliest of each group."""
        return tuple(group[0] for group in self.groups)

    def without(self, names: Collection[str], found: Probabilities) -> "Verdict":
        """Without groups whose likeliest has one of these names.

        Where no group that is left is sure: unexplained, or, of a gap that is not sure without them, no gap.
        """
        groups = tuple(group for group in self.groups if group[0] not in names)
        return _naming(groups, found)


def verdict_of(found: Probabilities) -> Verdict:
    """From probabilities.

    A group is the fewest effects, at most three, one of which the gap surely looks like, if there is one; there may be
    several groups, which act together; beside one that is sure a likely one is enough, and no group stands without a
    sure one. One that may as well be something else which only looks like it is not said.
    Whatever else may be present is left to the remainder; where there is no group at all the gap is unexplained.
    """
    groups: list[tuple[int, ...]] = []
    while len(groups) < MOST_GROUPS and (group := _group(found, groups)) is not None:
        groups.append(group)
    held = tuple(_named(found, group) for group in groups if found.any_present(group) >= HELD)
    return _naming(held, found)


def _named(found: Probabilities, group: tuple[int, ...]) -> tuple[str, ...]:
    return tuple(found.names[i] for i in group)


def _is_sure(found: Probabilities, group: tuple[str, ...]) -> bool:
    """Whether the gap, if there is one, looks like one of a group."""
    return found.any_seen([found.names.index(name) for name in group]) >= ENOUGH * (1 - found.null)


def _naming(groups: tuple[tuple[str, ...], ...], found: Probabilities) -> Verdict:
    if 1 - found.null < ALARM:
        return Verdict("no_gap", ())
    if not any(_is_sure(found, group) for group in groups):
        return Verdict("unexplained", ())
    return Verdict("named" if all(len(group) == 1 for group in groups) else "inseparable", groups)


def _group(found: Probabilities, before: list[tuple[int, ...]]) -> tuple[int, ...] | None:
    """Alternatives beside those of the groups before, the likeliest first."""
    taken = {i for group in before for i in group}
    likely = [int(i) for i in np.argsort(-found.marginal) if int(i) not in taken][:LOOKED_AT]
    for enough in (ENOUGH * (1 - found.null), *([BESIDE] if before else [])):
        for size in range(1, MOST_ALIKE + 1):
            chances = {group: found.any_seen(group) for group in combinations(likely, size)}
            best = max(chances, key=lambda group: chances[group], default=None)
            if best is not None and chances[best] >= enough:
                return best
    return None


class Eliminated(NamedTuple):
    """The twin with the effects that stay, and the names of those that do not, in the order in which they went."""

    best: Refit
    gone: tuple[str, ...]


def backward_elimination(
    linear: LinearModel, best: Refit, refitting: Refitting, priors: Priors, catalogue: int
) -> Eliminated:
    """Keeps as many effects as the fitted trials support; at least one."""
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


class Validated(NamedTuple):
    """A verdict after cross-validation.

    Attributes:
        verdict, probabilities: without what was withdrawn.
        best: the twin with the rest of the effects; None where none is left.
        skill: of the effects that stay, on trials left out in turn; None where nothing is named, or trials are too few.
        refutations: what was withdrawn, in that order; alternatives stay as probable.
    """

    verdict: Verdict
    probabilities: Probabilities
    best: Refit | None
    skill: SkillScore | None = None
    refutations: tuple[WithdrawnEffects, ...] = ()


def validated(
    found: Validated,
    linear: LinearModel,
    hypotheses: Hypotheses,
    refitting: Callable[[Sequence[str]], Refit],
    seed: int,
) -> Validated:
    """Withdraws names, the least probable first, for as long as they forecast trials left out worse."""
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
        refutations = (*refutations, WithdrawnEffects((weakest,), skill.value, skill.interval))
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
