"""Diagnosis of a session: where its gap lies, which effect makes it, and how far the gap shrinks with that effect."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Literal, NamedTuple

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from diagnosis.constants import MOST_LEFT
from diagnosis.evidence import Hypotheses, Priors
from diagnosis.experiments import next_experiments
from diagnosis.held_out import HeldOut
from diagnosis.linear_model import LinearModel
from diagnosis.local_discrepancies import ForceResponses, LocalDiscrepancy, likely_of, local_discrepancies, responses
from diagnosis.probabilities import Probabilities, explained
from diagnosis.refit import Refit, refitted
from diagnosis.result import Experiment, GapSize, Remainder
from diagnosis.ridge import RidgeFit, ridge_fit
from diagnosis.session_data import SessionData
from diagnosis.verdict import Validated, Verdict, backward_elimination, validated, verdict_of
from diagnosis.where import VarianceDecomposition, decompose
from fitting.progress import Progress, part_of
from fitting.signatures import Signature, signature_of
from swimmer.effects import Effect

Refitting = Callable[[Sequence[str]], Refit]
_ROUNDS = {"quick": 2, "full": 5}
_ROUNDS_OF_ALL = 3  # steps with all effects: in later ones the misfit only fluctuates
ALL_AT_ONCE = ("full",)
"""Efforts with which all effects are also fitted at once."""


@dataclass(frozen=True)
class Settings:
    """Settings of a diagnosis."""

    effort: Literal["quick", "full"] = "full"
    priors: Priors = field(default_factory=Priors)
    seed: int = 0


DEFAULT = Settings()


class Weighed(NamedTuple):
    """Hypotheses about the fitted swims, with their evidence.

    Attributes:
        linear: the linearised model of the fitted swims.
        signatures: what each effect does.
        forces: what missing forces do.
        elsewhere: the places where an unknown effect was looked for.
        hypotheses: all hypotheses of the residual.
        probabilities: their probabilities.
        decays_left_out: names of free decays that do not count, and why.
    """

    linear: LinearModel
    signatures: tuple[Signature, ...]
    forces: ForceResponses
    elsewhere: tuple[LocalDiscrepancy, ...]
    hypotheses: Hypotheses
    probabilities: Probabilities
    decays_left_out: Mapping[str, str]

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
        gap: errors on held-out swims that the twins can follow.
        everything: the twin with all effects at once, and its held-out gap; None where there is no gap, or the swims
            support no more than is named, or with the effort "quick".
        experiments: what to measure next, the most informative first.
        doubted: names of fitted swims that their own twin does not follow, for which nothing is named.
    """

    weighed: Weighed
    said: Validated
    where: VarianceDecomposition
    remainder: Remainder | None
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
    weighed = _weigh(data, effects, settings.priors, part_of(tell, 0.0, 0.42))
    refits, tell_refit = count(), part_of(tell, 0.42, 0.86)  # their number is not known in advance

    def refitting(names: Sequence[str]) -> Refit:
        chosen = [effects[name] for name in names]
        tell_refit(f"refitting with {' and '.join(names).replace('_', ' ')}", 1 - 0.75 ** next(refits))
        return refitted(weighed.linear, weighed.hypotheses, chosen, _ROUNDS[settings.effort])

    said = _name_effects(weighed, refitting, settings, len(effects))
    if data.doubted and said.verdict.effects:
        said = Validated(Verdict("unexplained", ()), said.probabilities, None)
    best, swims = said.best, HeldOut(weighed.linear, data.of_role(fitted=False), settings.seed)
    tell("held-out swims", 0.86)
    gap = swims.gap(best)
    tell("what to do next", 0.96)
    return Diagnosis(
        weighed=weighed,
        said=said,
        where=decompose(weighed.linear, weighed.forces, weighed.signatures, said.verdict.effects, weighed.placed),
        remainder=None if best is None else _remainder(weighed, best),
        gap=gap,
        everything=_everything(weighed, effects, said, swims, settings.effort),
        experiments=next_experiments(
            weighed.linear, weighed.hypotheses, said.verdict, said.probabilities, effects, settings.seed
        ),
        doubted=data.doubted,
    )


def _weigh(data: SessionData, effects: Mapping[str, Effect], priors: Priors, tell: Progress) -> Weighed:
    tell("the plain twin", 0.0)
    linear = data.linear
    signatures = []
    for number, effect in enumerate(effects.values()):
        tell(f"what {effect.name.replace('_', ' ')} would do", 0.14 + 0.46 * number / len(effects))
        signatures.append(signature_of(effect, linear.model, linear.camera, linear.at))
    tell("missing forces", 0.6)
    forces = responses(linear)
    tell("weighing hypotheses", 0.66)
    elsewhere = local_discrepancies(linear, forces)
    found = explained(linear, signatures, priors, elsewhere)
    return Weighed(
        found.linear,
        tuple(signatures),
        forces,
        elsewhere,
        found.hypotheses,
        found.probabilities,
        data.rings.left_out,
    )


def _name_effects(weighed: Weighed, refitting: Refitting, settings: Settings, effects: int) -> Validated:
    """Return the verdict that the fitted trials alone support."""
    probabilities, verdict = weighed.probabilities, verdict_of(weighed.probabilities)
    if not verdict.first:
        return Validated(verdict, probabilities, None)
    best, gone = backward_elimination(weighed.linear, refitting(verdict.first), refitting, settings.priors, effects)
    for name in gone:
        probabilities = probabilities.refuted(name)
    verdict = verdict.without(gone, probabilities) if gone else verdict
    most_stays = _remainder(weighed, best).share > MOST_LEFT and probabilities.with_other > 0.5
    if most_stays and (doubtful := [n for n in verdict.first if weighed.hypotheses.shows_in_features(n)]):
        verdict = verdict.without(doubtful, probabilities)  # the rest may be what only looks like these
        best = refitting(verdict.first) if verdict.first else best
    if not verdict.first:
        return Validated(Verdict("unexplained", ()), probabilities, None)
    said = Validated(verdict, probabilities, best)
    return validated(said, weighed.linear, weighed.hypotheses, refitting, settings.seed)


def _everything(
    weighed: Weighed, effects: Mapping[str, Effect], said: Validated, swims: HeldOut, effort: str
) -> tuple[RidgeFit, GapSize] | None:
    """Fit the twin with all effects and score it on held-out swims, just as it was fitted; None if not asked for."""
    if effort not in ALL_AT_ONCE or said.verdict.name == "no_gap":
        return None
    named = said.best or Refit.plain(weighed.linear)
    every = ridge_fit(weighed.linear, weighed.signatures, effects, named, _ROUNDS_OF_ALL)
    if every is None:
        return None
    return every, swims.gap(every.refit, as_fitted=True)


def _remainder(weighed: Weighed, best: Refit) -> Remainder:
    linear = weighed.linear
    rest = replace(linear)
    rest.__dict__["residual"] = best.residual
    where = decompose(rest, weighed.forces, weighed.signatures, placed=weighed.placed)
    plain, residual = (linear.space.projected(row) for row in (linear.residual, best.residual))
    numbers = int(linear.observed.sum())
    freedom = max(numbers - 5 - len(best.values), 1)
    excess, before = residual @ residual - freedom, plain @ plain - numbers + 5
    stages = {stage: share for stage, share in where.shares.by_stage.items() if stage != "floor"}
    share = float(np.clip(excess / before, 0.0, 1.0)) if before > 0 else 0.0
    return Remainder(share, max(stages, key=lambda stage: stages[stage]), float(chi2.sf(residual @ residual, freedom)))
