"""Diagnosis of a session from evidence to verdict, and the test of effects that a user names.

`diagnose` weighs all hypotheses, names the effects that the fitted trials support, scores the twin with these on
held-out swims, and says where the gap lies and what to measure next.

`weigh_effects` tests named effects, whatever else may be wrong. A diagnosis names an effect only where the evidence
leaves nothing else. A user who has a reason to suspect one, or several, can ask what the data determine about just
these: how much more likely they make the twin, each in addition to the others, and how far the gap shrinks with them.
Whatever they do not explain counts as a gap of no particular cause, of a size that suits it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Literal, NamedTuple

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from diagnosis.constants import (
    ADEQUATE,
    ENOUGH,
    FORM_ERROR,
    FORM_ERROR_OF_CHANGE,
    LIKE_A_CHANGE,
    MOST_LEFT,
    MOST_LEFT_OF_CHANGE,
    ONE_CHANGE,
    STRONGEST_CHANGE_SD,
)
from diagnosis.evidence import Hypotheses, Priors
from diagnosis.experiments import next_experiments
from diagnosis.held_out import HeldOut, errors_of, forecast_scores
from diagnosis.hypotheses import Assumed, AveragedHypotheses, Probabilities, average_hypotheses, error_sizes
from diagnosis.linear_model import LinearModel, SessionData
from diagnosis.places import ForceResponses, LocalDiscrepancy, likely_of, local_discrepancies, responses
from diagnosis.reference import Comparison, weigh_refits
from diagnosis.refit import Refit, RidgeFit, refit_effects, refit_from, ridge_fit
from diagnosis.result import Adequacy, ComparedWith, Experiment, GapSize, Remainder
from diagnosis.unknown_effects import stage_probabilities, unknown_effects
from diagnosis.verdict import (
    Refitting,
    Validated,
    Verdict,
    backward_elimination,
    is_near,
    log_evidence,
    validated,
    verdict_of,
    without_refuted,
)
from diagnosis.where import GapComponent, VarianceDecomposition, decompose, shares_by_stage
from fitting.left_out import far_reason
from fitting.progress import Progress, part_of
from fitting.signatures import Signature, signature_of
from fitting.trial import MeasuredTrial
from fitting.trial_checks import CREEPS, WOBBLES
from swimcal.effects.effect import Effect
from swimcal.errors import NotEnoughData

# The diagnosis
_UNEXPLAINED = Verdict("unexplained", ())
_ROUNDS = {"quick": 2, "full": 5}  # steps of a refit, by effort
_ROUNDS_OF_ALL = 3  # steps with all effects: in later ones the misfit only fluctuates
ALL_AT_ONCE = ("full",)
"""Efforts with which all effects are also fitted at once."""
_BEFORE_ALL = 0.65  # share of the time before all effects are fitted at once, with those efforts

# The test of named effects
_ROUNDS_OF_TEST = {"quick": 3, "full": 8}  # steps of a refit, by effort


@dataclass(frozen=True)
class Settings:
    """Settings of a diagnosis."""

    effort: Literal["quick", "full"] = "full"
    priors: Priors = field(default_factory=Priors)
    seed: int = 0


DEFAULT = Settings()


class WeighedEvidence(NamedTuple):
    """Hypotheses about the fitted swims, with their evidence.

    Attributes:
        linear: the linearised model of the fitted swims.
        signatures: what each effect does.
        forces: what missing forces do.
        elsewhere: the places where an unknown effect was looked for.
        hypotheses: all hypotheses of the residual.
        probabilities: their probabilities.
        decays_left_out: names of free decays that do not count, and why.
        usual: the same hypotheses beside the usual error of the twin, where a smaller one is likelier; else None.
        reference: what it is compared with; None without a reference session.
    """

    linear: LinearModel
    signatures: tuple[Signature, ...]
    forces: ForceResponses
    elsewhere: tuple[LocalDiscrepancy, ...]
    hypotheses: Hypotheses
    probabilities: Probabilities
    decays_left_out: Mapping[str, str]
    usual: AveragedHypotheses | None = None
    reference: ComparedWith | None = None

    @property
    def beside_usual_error(self) -> "WeighedEvidence":
        """The evidence where the twin's own error has its usual size, beside which unknown effects may act."""
        if self.usual is None:
            return self
        linear, hypotheses, probabilities, _ = self.usual
        return self._replace(linear=linear, hypotheses=hypotheses, probabilities=probabilities, usual=None)

    @property
    def placed(self) -> Sequence[LocalDiscrepancy]:
        """Places where an unknown effect is likely."""
        return likely_of(self.elsewhere, self.probabilities.at_place)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Diagnosis of one session.

    Attributes:
        weighed: the hypotheses.
        said: verdict and probabilities after cross-validation, and the twin with the likeliest of the named effects.
        where: shares of the gap.
        remainder: residual of that twin; None where nothing is named.
        adequate: whether the best set of effects leaves no more than noise.
        unknown_at: where it leaves more, the probability of each stage that an effect outside the catalogue acts there.
        gap: errors on held-out swims that the twins can follow.
        everything: the twin with all effects at once, and its held-out gap; None where there is no gap, or the swims
            support no more than is named, or with the effort "quick".
        experiments: what to measure next, the most informative first.
        doubted: names of fitted swims that their own twin does not follow, with the found effects neither: because of
            these nothing is named.
    """

    weighed: WeighedEvidence
    said: Validated
    where: VarianceDecomposition
    remainder: Remainder | None
    adequate: Adequacy
    unknown_at: Mapping[str, float]
    gap: GapSize
    everything: tuple[RidgeFit, GapSize] | None
    experiments: tuple[Experiment, ...]
    doubted: tuple[str, ...] = ()


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def diagnose(
    data: SessionData,
    effects: Mapping[str, Effect],
    settings: Settings = DEFAULT,
    tell: Progress = lambda _message, _share: None,
) -> Diagnosis:
    """Diagnose a session.

    Args:
        data: the recordings of the session.
        effects: the catalogue, by name.
        settings: effort, priors and seed.
        tell: takes messages with the share of the work that is done.

    Raises:
        SimulationDiverged: the plain twin diverged.
        NotEnoughData: there is no fitted swim.
    """
    if data.reference is None and all(trial.logged_hz is None for trial in data.of_role(fitted=True)):
        effects = {name: effect for name, effect in effects.items() if not effect.needs_log}
    weigh = _weigh if data.reference is None else _weigh_change
    alone = _BEFORE_ALL if settings.effort in ALL_AT_ONCE and data.reference is None else 1.0
    tell, tell_all = part_of(tell, 0.0, alone), part_of(tell, alone, 1.0)
    weighed = weigh(data, effects, settings.priors, part_of(tell, 0.0, 0.78))
    weighed, said, refitting = _name_beside_likelier_error(weighed, effects, settings, part_of(tell, 0.78, 0.88))
    doubted = data.doubted
    if doubted and said.verdict.effects:
        if said.best is not None:
            doubted = _not_followed(weighed.linear, said.best)
        if doubted:
            said = Validated(_UNEXPLAINED, said.probabilities, None)
    if said.verdict.name == "no_gap" and any(_moves_otherwise(trial) for trial in data.of_role(fitted=True)):
        said = Validated(_UNEXPLAINED, said.probabilities, None)  # features do not show it
    best, swims = said.best, HeldOut(weighed.linear, data.of_role(fitted=False), settings.seed)
    tell("held-out swims", 0.88)
    gap = swims.gap(best)
    if gap.grows and (left := without_refuted(said, gap, weighed.hypotheses, refitting)) is not said:
        said, best = left, left.best
        gap = swims.gap(best)
    tell("what to do next", 0.96)
    adequate = adequacy(weighed, best)
    unknown_at, unknown = _unknown(weighed) if adequate.p_value < ADEQUATE else ({}, {})
    return Diagnosis(
        weighed=weighed,
        said=said,
        where=decompose(
            weighed.linear, weighed.forces, weighed.signatures, said.verdict.effects, weighed.placed, unknown
        ),
        remainder=None if best is None else _remainder(weighed, best),
        adequate=adequate,
        unknown_at=unknown_at,
        gap=gap,
        everything=_everything(weighed, effects, said, swims, settings.effort, tell_all),
        experiments=()
        if data.reference is not None
        else next_experiments(
            weighed.linear, weighed.hypotheses, said.verdict, said.probabilities, effects, settings.seed
        ),
        doubted=doubted,
    )


def _name_beside_likelier_error(
    weighed: WeighedEvidence, effects: Mapping[str, Effect], settings: Settings, tell: Progress
) -> tuple[WeighedEvidence, Validated, Refitting]:
    """Return the evidence that counts, the verdict on it, and how the twin is refitted with effects there.

    Beside a small error of the twin no unknown effect was weighed, and refits forecast worse. So the usual error counts
    where the same names stand beside it, or where none does beside the small one.
    """
    naming, refits = _name_effects if weighed.reference is None else _name_change, count()

    def judge(of: WeighedEvidence) -> tuple[WeighedEvidence, Validated, Refitting]:
        def refitting(names: Sequence[str]) -> Refit:
            chosen = [effects[name] for name in names]
            tell(f"refitting with {' and '.join(names).replace('_', ' ')}", 1 - 0.75 ** next(refits))
            return refit_effects(of.linear, of.hypotheses, chosen, _ROUNDS[settings.effort])

        return of, naming(of, refitting, settings, len(effects)), refitting

    found = judge(weighed)
    if weighed.usual is None:
        return found
    usual = judge(weighed.beside_usual_error)
    here, there = found[1].verdict, usual[1].verdict
    return usual if here.name == "unexplained" or here == there else found


def _unknown(weighed: WeighedEvidence) -> tuple[dict[str, float], dict[GapComponent, np.ndarray]]:
    """Return the probability of each stage of an unknown effect, and the columns (k, q) of its laws at a sure one."""
    members = unknown_effects(weighed.linear, weighed.forces, weighed.signatures)
    chances = stage_probabilities(weighed.linear, members)
    likeliest = max(chances, key=lambda stage: chances[stage])
    return chances, members[likeliest] if chances[likeliest] >= ENOUGH else {}


def _moves_otherwise(trial: MeasuredTrial) -> bool:
    """Return whether a trial is flagged for a motion that features do not show."""
    return any(flag.kind in (WOBBLES, CREEPS) for flag in trial.flags)


def _weigh(data: SessionData, effects: Mapping[str, Effect], priors: Priors, tell: Progress) -> WeighedEvidence:
    tell("the plain twin", 0.0)
    linear = data.linear
    signatures = _signatures(linear, effects, tell)
    tell("how large the twin's own error is", 0.55)
    return _weighed(data, error_sizes(linear, signatures, priors), signatures, priors, tell)


def _weigh_change(data: SessionData, effects: Mapping[str, Effect], priors: Priors, tell: Progress) -> WeighedEvidence:
    """Weigh what may have changed since the reference session."""
    priors = replace(
        priors,
        form_error=FORM_ERROR_OF_CHANGE,
        most_wrong=np.inf,
        strongest=STRONGEST_CHANGE_SD,
        by_part=True,
        number=ONE_CHANGE,
        look_alike_beside=LIKE_A_CHANGE,
    )
    tell("the plain twin in both sessions", 0.0)
    both = Comparison.of(data)
    both = both.with_signatures(_signatures(both.joint, effects, tell))
    found = _weighed(data, both.assumptions(), both.of_changed, priors, tell)
    return found._replace(reference=both.compared_with(found.hypotheses))


def _signatures(linear: LinearModel, effects: Mapping[str, Effect], tell: Progress) -> tuple[Signature, ...]:
    found = []
    for number, effect in enumerate(effects.values()):
        tell(f"what {effect.name.replace('_', ' ')} would do", 0.13 + 0.42 * number / len(effects))
        found.append(signature_of(effect, linear.model, linear.camera, linear.at))
    return tuple(found)


def _weighed(
    data: SessionData,
    assumptions: Sequence[Assumed],
    signatures: tuple[Signature, ...],
    priors: Priors,
    tell: Progress,
) -> WeighedEvidence:
    """Weigh all hypotheses; missing forces do not depend on what is assumed."""
    tell("missing forces", 0.7)
    linear = assumptions[0].linear
    forces = responses(linear)
    tell("weighing hypotheses", 0.83)
    elsewhere = local_discrepancies(linear, forces)
    found = average_hypotheses(assumptions, signatures, priors, elsewhere)
    return WeighedEvidence(
        found.linear,
        signatures,
        forces,
        elsewhere,
        found.hypotheses,
        found.probabilities,
        data.rings.left_out,
        found.usual,
    )


def _name_effects(weighed: WeighedEvidence, refitting: Refitting, settings: Settings, effects: int) -> Validated:
    """Return the verdict that the fitted trials alone support."""
    probabilities, verdict = weighed.probabilities, verdict_of(weighed.probabilities)
    if not verdict.first:
        falls_short = verdict.name == "unexplained" and adequacy(weighed, None).p_value < ADEQUATE
        return Validated(verdict, probabilities.doubted() if falls_short else probabilities, None)
    best, gone = backward_elimination(weighed.linear, refitting(verdict.first), refitting, settings.priors, effects)
    for name in gone:
        probabilities = probabilities.refuted(name)
    verdict = verdict.without(gone, probabilities) if gone else verdict
    most_stays = _share_left(weighed.linear, best) > MOST_LEFT and probabilities.with_other > 0.5
    if most_stays and (doubtful := [n for n in verdict.first if weighed.hypotheses.shows_in_features(n)]):
        verdict = verdict.without(doubtful, probabilities)  # the rest may be what only looks like these
        best = refitting(verdict.first) if verdict.first else best
    p_value = adequacy(weighed, best if verdict.first else None).p_value
    near = is_near(p_value, ADEQUATE) and bool(verdict.first)
    if p_value < ADEQUATE:
        return Validated(_UNEXPLAINED, probabilities.doubted(), None, near=verdict if near else None)
    if not verdict.first:
        return Validated(_UNEXPLAINED, probabilities, None)
    said = Validated(verdict, probabilities, best, near=_UNEXPLAINED if near else None)
    return validated(said, weighed.linear, weighed.hypotheses, refitting, settings.seed)


def _name_change(weighed: WeighedEvidence, refitting: Refitting, _settings: Settings, _effects: int) -> Validated:
    """Return the verdict on a change since a reference.

    A third of what changed must be told before it has a name, unless markers surely slide aside as an effect says:
    nothing else makes them.
    """
    probabilities, verdict = weighed.probabilities, verdict_of(weighed.probabilities)
    if verdict.name == "no_gap":
        return Validated(verdict, probabilities, None)
    probabilities, refits = weigh_refits(weighed.linear, weighed.hypotheses, probabilities, refitting)
    verdict = verdict_of(probabilities)
    best = refits.get(verdict.first[0]) if verdict.first else None
    if best is not None and weighed.hypotheses.shows_in_creeps(verdict.first[0]):
        return Validated(verdict, probabilities, best)
    share = 1.0 if best is None else _share_left(weighed.linear, best)
    near = is_near(share, MOST_LEFT_OF_CHANGE)
    if share <= MOST_LEFT_OF_CHANGE:
        return Validated(verdict, probabilities, best, near=_UNEXPLAINED if near else None)
    return Validated(_UNEXPLAINED, probabilities.doubted(), None, near=verdict if near else None)


def _everything(
    weighed: WeighedEvidence,
    effects: Mapping[str, Effect],
    said: Validated,
    swims: HeldOut,
    effort: str,
    tell: Progress,
) -> tuple[RidgeFit, GapSize] | None:
    """Fit the twin with all effects and score it on held-out swims, just as it was fitted; None if not asked for."""
    if effort not in ALL_AT_ONCE or said.verdict.name == "no_gap" or weighed.linear.given is not None:
        return None
    named = said.best or Refit.plain(weighed.linear)
    tell("all effects at once", 0.0)
    every = ridge_fit(weighed.linear, weighed.signatures, effects, named, _ROUNDS_OF_ALL)
    if every is None:
        return None
    return every, swims.gap(every.refit, as_fitted=True)


def adequacy(weighed: WeighedEvidence, best: Refit | None) -> Adequacy:
    """Tell whether a refitted twin, or without one the likeliest set of effects, leaves no more than noise.

    An effect's form is not exactly the twin's: a share `FORM_ERROR` of what the effects explain counts as noise.

    Args:
        weighed: the hypotheses.
        best: the twin with the named effects; None where none is named.
    """
    linear, seen = weighed.linear, weighed.hypotheses.like_any
    plain = linear.space.projected(linear.residual)
    if best is None:
        of = weighed.probabilities.of
        present = max(of, key=lambda each: of[each]).present
        forms = [form for form in (weighed.hypotheses.best[i] for i in present) if form is not None]
        columns = np.hstack([np.zeros((len(plain), 0)), *(form.columns for form in forms)])
        left = plain - columns @ np.linalg.lstsq(columns, plain, rcond=None)[0]
        free = columns.shape[1]
    else:
        left, free = linear.space.projected(best.residual), len(best.values)
    explained = FORM_ERROR * float(np.linalg.norm(plain - left))
    variance = 1 + explained**2 / len(seen.spread) * seen.spread
    squares = float(((seen.turn @ left) ** 2 / variance).sum())
    numbers = max(int(linear.observed.sum()) - free, 1)
    return Adequacy(float(chi2.sf(squares, numbers)), squares, numbers)


def _not_followed(linear: LinearModel, best: Refit) -> tuple[str, ...]:
    """Return the names of fitted swims that also the twin with effects does not follow."""
    scores = forecast_scores(linear, linear.swims, best.effects, best.at, best.values)
    errors_m = [score.launch_free_error_m for score in scores]
    return tuple(
        score.name
        for i, score in enumerate(scores)
        if far_reason(score.speed_measured, score.speed_twin, errors_m[i], [*errors_m[:i], *errors_m[i + 1 :]])
    )


def _remainder(weighed: WeighedEvidence, best: Refit) -> Remainder:
    linear = weighed.linear.with_residual(best.residual)
    shares = shares_by_stage(linear, weighed.forces, weighed.signatures, weighed.placed)
    stages = {stage: share for stage, share in shares.items() if stage != "floor"}
    squares, freedom = _squares_left(linear, best)
    share = _share_left(weighed.linear, best)
    return Remainder(share, max(stages, key=lambda stage: stages[stage]), float(chi2.sf(squares, freedom)))


def _share_left(linear: LinearModel, best: Refit) -> float:
    """Return the share of the gap, noise apart, that a refitted twin leaves."""
    (left, freedom), plain = _squares_left(linear, best), linear.space.projected(linear.residual)
    before = plain @ plain - int(linear.observed.sum()) + len(linear.slopes.T)
    return float(np.clip((left - freedom) / before, 0.0, 1.0)) if before > 0 else 0.0


def _squares_left(linear: LinearModel, best: Refit) -> tuple[float, int]:
    """Return the squared norm of what a refitted twin leaves, and how large noise alone would be."""
    residual = linear.space.projected(best.residual)
    freedom = max(int(linear.observed.sum()) - len(linear.slopes.T) - len(best.values), 1)
    return float(residual @ residual), freedom


# The test of effects that a user names.


@dataclass(frozen=True, eq=False)
class WeighedEffects:
    """Test of effects: the twin with them against the plain one, both refitted to the same swims.

    Attributes:
        refit: the twin with the effects.
        log_bayes_factor: natural logarithm of how much more probable the fitted swims are with them.
        of_each: log Bayes factor of each effect in addition to all others that are tested.
        fitted: errors on the fitted swims, of the plain twin and of the one with effects.
        gap: errors on the held-out swims that the twins can follow.
    """

    refit: Refit
    log_bayes_factor: float
    of_each: Mapping[str, float]
    fitted: GapSize
    gap: GapSize


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def weigh_effects(
    data: SessionData,
    effects: Sequence[Effect],
    settings: Settings | None = None,
    tell: Progress = lambda _message, _share: None,
) -> WeighedEffects:
    """Refit the twin with the effects and weigh it against the plain one.

    Args:
        data: the recordings of the session.
        effects: the effects to test.
        settings: effort, priors and seed; by default those of a full diagnosis.
        tell: takes messages with the share of the work that is done.

    Raises:
        SimulationDiverged: the plain twin diverged.
        NotEnoughData: there is no fitted swim, or an effect does nothing in these.
    """
    settings = settings or Settings()
    tell("the plain twin", 0.0)
    linear = data.linear
    tell("what the tested effects would do", 0.4)
    signatures = [signature_of(effect, linear.model, linear.camera, linear.at) for effect in effects]
    weighed = average_hypotheses(error_sizes(linear, signatures, settings.priors), signatures, settings.priors)
    linear, hypotheses = weighed.linear, weighed.hypotheses
    _refuse_idle(signatures, hypotheses)
    rounds = _ROUNDS_OF_TEST[settings.effort]
    tell("refitting with them", 0.5)
    best, plain = refit_effects(linear, hypotheses, effects, rounds), refit_from(linear, (), np.zeros(0), rounds)
    evidence, of_each = log_evidence(linear, best), {}
    for number, effect in enumerate(effects):
        tell(f"refitting without {effect.name.replace('_', ' ')}", 0.6 + 0.3 * number / len(effects))
        others = [other for other in effects if other is not effect]
        without = refit_effects(linear, hypotheses, others, rounds) if others else plain
        of_each[effect.name] = evidence - log_evidence(linear, without)
    tell("held-out swims", 0.9)
    pair = [forecast_scores(linear, linear.swims, fit.effects, fit.at, fit.values) for fit in (plain, best)]
    gap = HeldOut(linear, data.of_role(fitted=False), settings.seed).gap(best)
    return WeighedEffects(best, evidence - log_evidence(linear, plain), of_each, errors_of(*pair), gap)


def _refuse_idle(signatures: Sequence[Signature], hypotheses: Hypotheses) -> None:
    """Refuse effects without a response, for which there is nothing to refit."""
    faults = []
    for signature, form in zip(signatures, hypotheses.best, strict=True):
        if form is None:
            stands = np.isfinite(signature.rows).all(axis=1).any()
            why = "changes nothing in the fitted swims" if stands else "makes the twin diverge at every strength tried"
            faults.append(f"{signature.effect.name} {why}")
    if faults:
        raise NotEnoughData(f"{'; '.join(faults)}: leave it out, or fit swims in which it shows")
