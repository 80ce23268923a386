"""Test of effects that a user names, whatever else may be wrong.

A diagnosis names an effect only where the evidence leaves nothing else. A user who has a reason to suspect one, or
several, can ask what the data determine about just these: how much more likely they make the twin, each in addition to
the others, and how far the gap shrinks with them. Whatever they do not explain counts as a gap of no particular cause,
of a size that suits it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from diagnosis.affected_swims import forecast_scores
from diagnosis.diagnosis import Settings
from diagnosis.evidence import Hypotheses
from diagnosis.held_out import HeldOut, errors_of
from diagnosis.probabilities import explained
from diagnosis.refit import Refit, refit, refitted
from diagnosis.result import GapSize
from diagnosis.session_data import SessionData
from diagnosis.verdict import log_evidence
from fitting.progress import Progress
from fitting.signatures import Signature, signature_of
from session import NotEnoughData
from swimmer.effects import Effect

_ROUNDS = {"quick": 3, "full": 8}


@dataclass(frozen=True, eq=False)
class EffectTest:
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
) -> EffectTest:
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
    weighed = explained(linear, signatures, settings.priors)
    linear, hypotheses = weighed.linear, weighed.hypotheses
    _refuse_idle(signatures, hypotheses)
    rounds = _ROUNDS[settings.effort]
    tell("refitting with them", 0.5)
    best, plain = refitted(linear, hypotheses, effects, rounds), refit(linear, (), np.zeros(0), rounds)
    evidence, of_each = log_evidence(linear, best), {}
    for number, effect in enumerate(effects):
        tell(f"refitting without {effect.name.replace('_', ' ')}", 0.6 + 0.3 * number / len(effects))
        others = [other for other in effects if other is not effect]
        without = refitted(linear, hypotheses, others, rounds) if others else plain
        of_each[effect.name] = evidence - log_evidence(linear, without)
    tell("held-out swims", 0.9)
    pair = [forecast_scores(linear, linear.swims, fit.effects, fit.at, fit.values) for fit in (plain, best)]
    gap = HeldOut(linear, data.of_role(fitted=False), settings.seed).gap(best)
    return EffectTest(best, evidence - log_evidence(linear, plain), of_each, errors_of(*pair), gap)


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
