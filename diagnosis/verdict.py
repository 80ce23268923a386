"""Verdict of a diagnosis: one name, a few inseparable names, something unknown, or no gap.

`verdict_of` names effects by their probabilities. Among several named effects those stay that the fitted trials
support, and that carry over between them. `backward_elimination`: the twin is refitted without each in turn, so that
each must improve the real simulation, not only the linear model; the weakest is removed until all that stay are likely
enough to be named (Laplace's approximation of the evidence; MacKay 2003, chapter 28). `validated`, leave-one-trial-out
cross-validation: each fitted swim trial is forecast by twins that are refitted to all other data, linear about the fit
to all; where the whole 95 % interval of the skill lies below zero, the least probable effect is withdrawn. Held-out
trials are opened once, to score. They never choose a name; one that makes their forecasts surely worse is withdrawn
(`without_refuted`).
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logit

from diagnosis.constants import (
    ALARM,
    BESIDE,
    ENOUGH,
    FEWEST_TRIALS,
    HELD,
    LOOKED_AT,
    MOST_ALIKE,
    MOST_GROUPS,
    NEAR_THRESHOLD,
)
from diagnosis.evidence import Hypotheses, Priors
from diagnosis.held_out import SkillScore, skill_score
from diagnosis.hypotheses import Probabilities
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit
from diagnosis.result import GapSize, VerdictName, WithdrawnEffects

Refitting = Callable[[Sequence[str]], Refit]


@dataclass(frozen=True)
class Verdict:
    """A verdict: groups that act together, each of alternatives, the likeliest first."""

    name: VerdictName
    groups: tuple[tuple[str, ...], ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of all effects in the groups, each once."""
        return tuple(dict.fromkeys(name for group in self.groups for name in group))

    @property
    def first(self) -> tuple[str, ...]:
        """Name of the likeliest effect of each group."""
        return tuple(group[0] for group in self.groups)

    def without(self, names: Collection[str], found: Probabilities) -> "Verdict":
        """Return the verdict without groups whose likeliest effect has one of these names.

        Without a certain group left it is unexplained; it is no gap where no gap is certain without these effects.

        Args:
            names: names of the effects that are withdrawn.
            found: probabilities without these.
        """
        groups = tuple(group for group in self.groups if group[0] not in names)
        return _naming(groups, found)


def verdict_of(found: Probabilities, shift: float = 0.0) -> Verdict:
    """Derive the verdict from probabilities.

    A group holds the fewest effects, at most three, of which the gap certainly looks like one; it stays if one of them
    is itself likely enough to be present, not just something that looks like it. There may be several groups, which act
    together: the first must be certain, for further ones likely is enough. Without a group the gap is unexplained.

    Args:
        found: the probabilities.
        shift: what is added to every threshold, to see how near it lies.
    """
    groups: list[tuple[int, ...]] = []
    while len(groups) < MOST_GROUPS and (group := _group(found, groups, shift)) is not None:
        groups.append(group)
    held = tuple(tuple(found.names[i] for i in group) for group in groups if found.any_present(group) >= HELD + shift)
    return _naming(held, found, shift)


def borderline(said: Verdict, found: Probabilities) -> Verdict | None:
    """Return the other verdict that slightly other thresholds would lead to.

    None where the verdict is clear, or was changed by a later check.

    Args:
        said: the verdict.
        found: the probabilities that it rests on.
    """
    if verdict_of(found) != said:
        return None  # it does not rest on these thresholds alone
    near = (verdict_of(found, shift) for shift in (-NEAR_THRESHOLD, NEAR_THRESHOLD))
    return next((other for other in near if other != said), None)


def is_near(value: float, threshold: float) -> bool:
    """Tell whether a probability or a share is so near to a threshold that it is told."""
    return abs(value - threshold) <= NEAR_THRESHOLD


def _is_sure(found: Probabilities, group: tuple[str, ...], shift: float = 0.0) -> bool:
    """Tell whether the gap, if there is one, certainly looks like one of a group."""
    seen = found.any_seen([found.names.index(name) for name in group])
    return seen >= (ENOUGH + shift) * (1 - found.null)


def _naming(groups: tuple[tuple[str, ...], ...], found: Probabilities, shift: float = 0.0) -> Verdict:
    if 1 - found.null < ALARM + shift:
        return Verdict("no_gap", ())
    if not any(_is_sure(found, group, shift) for group in groups):
        return Verdict("unexplained", ())
    return Verdict("named" if all(len(group) == 1 for group in groups) else "inseparable", groups)


def _group(found: Probabilities, before: list[tuple[int, ...]], shift: float) -> tuple[int, ...] | None:
    """Return the next group of alternatives after the groups before, the likeliest first."""
    taken = {i for group in before for i in group}
    likely = [int(i) for i in np.argsort(-found.marginal) if int(i) not in taken][:LOOKED_AT]
    for enough in ((ENOUGH + shift) * (1 - found.null), *([BESIDE + shift] if before else [])):
        for size in range(1, MOST_ALIKE + 1):
            chances = {group: found.any_seen(group) for group in combinations(likely, size)}
            best = max(chances, key=lambda group: chances[group], default=None)
            if best is not None and chances[best] >= enough:
                return best
    return None


def backward_elimination(
    linear: LinearModel, best: Refit, refitting: Refitting, priors: Priors, catalogue: int
) -> tuple[Refit, tuple[str, ...]]:
    """Keep as many effects as the fitted trials support; at least one.

    Args:
        linear: the linearised model of the fitted trials.
        best: the twin with all effects.
        refitting: refits the twin with named effects.
        priors: prior probabilities.
        catalogue: number of effects in the catalogue.

    Returns:
        The twin with the effects that stay, and the names of the others in the order of their removal.
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
    return best, gone


def log_evidence(linear: LinearModel, fit: Refit) -> float:
    """Return the log evidence of a refitted twin, up to a constant that all twins share.

    The residual is normal, of a size that suits it. The prior of a parameter is as wide as the effect has it, or wider
    where the effect is stronger, all of its parameters by the same factor; one that the trials do not determine costs
    nothing and gains nothing.

    Args:
        linear: the linearised model of the fitted swims.
        fit: the refitted twin.
    """
    space = linear.with_gap_in(fit.residual)
    white = solve_triangular(space.root, fit.residual, lower=True)
    width = np.append(linear.prior_sd, fit.width)
    off, precision = np.concatenate([fit.at - linear.at, fit.values]), fit.precision(width)
    pull = (width**-2.0 - fit.taken**-2.0) * off  # the likeliest point moves as the prior does
    volume = -0.5 * float(np.linalg.slogdet(precision)[1]) - float(np.log(width).sum())
    likelihood = -0.5 * float(white @ white) - float(np.log(np.diag(space.root)).sum())
    return likelihood + volume - 0.5 * float((off / width) @ (off / width) - pull @ np.linalg.solve(precision, pull))


class Validated(NamedTuple):
    """A verdict after cross-validation.

    Attributes:
        verdict, probabilities: those without the withdrawn effects.
        best: the twin with the rest of the effects; None where none is left.
        skill: skill of the effects that stay, on trials left out in turn; None where nothing is named, or trials are
            too few.
        refutations: the withdrawn effects, in that order; alternatives stay as probable.
        near: the other verdict, where a check after the probabilities nearly led to it; else None.
    """

    verdict: Verdict
    probabilities: Probabilities
    best: Refit | None
    skill: SkillScore | None = None
    refutations: tuple[WithdrawnEffects, ...] = ()
    near: Verdict | None = None


def validated(
    found: Validated,
    linear: LinearModel,
    hypotheses: Hypotheses,
    refitting: Refitting,
    seed: int,
) -> Validated:
    """Withdraw names, the least probable first, for as long as they forecast left-out trials worse.

    Args:
        found: the verdict before cross-validation.
        linear: the linearised model of the fitted trials.
        hypotheses: its hypotheses.
        refitting: refits the twin with named effects.
        seed: seed of the skill's draws.
    """
    if found.best is None or len(linear.swims) < FEWEST_TRIALS:
        return found
    verdict, probabilities, best, _, refutations, near = found
    plain = left_out(linear, Refit.plain(linear))
    while best is not None:
        skill = skill_score(plain, left_out(linear, best), linear.trial_of[linear.scored], seed)
        against = refutable(skill, best, hypotheses)
        if not against:
            return Validated(verdict, probabilities, best, skill, refutations, None if refutations else near)
        weakest = min(against, key=lambda name: probabilities.marginal[probabilities.names.index(name)])
        assert skill.value is not None
        assert skill.interval is not None
        refutations = (*refutations, WithdrawnEffects((weakest,), skill.value, skill.interval))
        probabilities = probabilities.refuted(weakest)
        verdict = verdict.without([weakest], probabilities)
        best = refitting(verdict.first) if verdict.first else None
    return Validated(verdict, probabilities, None, None, refutations)


def refutable(skill: SkillScore, best: Refit, hypotheses: Hypotheses) -> tuple[str, ...]:
    """Return the effects of a refitted twin that forecasts speak against; none where they do not.

    Effects that change frequencies are never among them: the skill leaves these out.

    Args:
        skill: skill of the effects in cross-validation.
        best: the refitted twin.
        hypotheses: the hypotheses of the session.
    """
    if skill.interval is None or skill.interval[1] >= 0:
        return ()
    return tuple(effect.name for effect in best.effects if hypotheses.shows_in_features(effect.name))


def without_refuted(found: Validated, gap: GapSize, hypotheses: Hypotheses, refitting: Refitting) -> Validated:
    """Withdraw names with which trials that nothing was fitted to are surely forecast worse.

    Effects that change frequencies stay, as in cross-validation: the skill leaves these out.

    Args:
        found: the verdict of the fitted trials.
        gap: errors on the held-out trials, which grow with these names.
        hypotheses: the hypotheses of the session.
        refitting: refits the twin with named effects.
    """
    names = tuple(name for name in found.verdict.first if hypotheses.shows_in_features(name))
    if not names:
        return found
    verdict = found.verdict.without(names, found.probabilities)
    withdrawn = WithdrawnEffects(names, held_out_mm=(gap.baseline_mm, gap.with_effects_mm))
    best = refitting(verdict.first) if verdict.first else None
    return Validated(verdict, found.probabilities, best, None, (*found.refutations, withdrawn))


def left_out(linear: LinearModel, fit: Refit) -> np.ndarray:
    """Return the whitened residual (q,) of all fitted swim trials, each forecast by a twin refitted without it."""
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
