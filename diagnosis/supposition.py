"""What somebody supposes: the twin with effects that a user names, whatever else may be amiss.

A diagnosis names an effect only where the evidence leaves nothing else. Who has a reason to suspect one, or several,
can ask what the swims say of just these: how much likelier they make the twin, each beside the others, and how far the
gap shrinks with them. Whatever they do not explain counts as a gap of no particular cause, of a size that suits it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from diagnosis.affected_swims import Swum, swum
from diagnosis.diagnosis import Settings, Tell
from diagnosis.discrepancy import Discrepancy
from diagnosis.evidence import Explanations
from diagnosis.explaining import explained
from diagnosis.from_forms import refitted
from diagnosis.ground import Ground
from diagnosis.held_out import Gap, HeldOut
from diagnosis.pruning import log_evidence
from diagnosis.refit import Refit
from diagnosis.rings import rings_of
from fitting.out_of_water import NOTHING, OutOfWater
from fitting.signatures import Signature, signature_of
from fitting.signatures.view_of import with_picture
from fitting.trial import MeasuredTrial
from session import CameraSpec, NotEnoughData
from swimmer import Twin
from swimmer.effects import Effect

_ROUNDS = {"quick": 3, "full": 8}


@dataclass(frozen=True, eq=False)
class Supposition:
    """The twin with supposed effects beside the plain one, both refitted to the same swims.

    Attributes:
        refit: the twin with them.
        log_bayes_factor: natural logarithm of how much more probable the fitted swims are with them.
        of_each: the same of each effect beside all others that are supposed.
        fitted: the fitted swims beside the plain twin, and beside the one with effects.
        gap: of the held-out swims; None without any that the twins can follow.
    """

    refit: Refit
    log_bayes_factor: float
    of_each: Mapping[str, float]
    fitted: tuple[tuple[Swum, ...], tuple[Swum, ...]]
    gap: Gap | None


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def suppose(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    camera: CameraSpec,
    effects: Sequence[Effect],
    discrepancy: Discrepancy,
    settings: Settings | None = None,
    tell: Tell = lambda _message, _share: None,
    dry: OutOfWater = NOTHING,
) -> Supposition:
    """Refits the twin with effects.

    Args:
        trials, twin, camera, discrepancy, tell, dry: as of `diagnose`.
        effects: that are supposed, each once.
        settings: how much work, and the seed.

    Raises:
        SimulationDiverged: the plain twin, from every start.
        NotEnoughData: no fitted swim, or an effect that does nothing in these.
    """
    settings = settings or Settings()
    trials, runs = ([trial.without_log for trial in each] for each in (trials, dry.runs))
    fitted, held = ([trial for trial in trials if (trial.role == "fit") == own] for own in (True, False))
    if not fitted:
        raise NotEnoughData('no swim of role "fit"; a supposition needs at least one')
    camera = with_picture(camera, (*trials, *runs))
    tell("fitting the plain twin", 0.0)
    rings = rings_of(dry.decays, twin)
    ground = Ground.fitted(fitted, twin, camera, discrepancy, runs, rings=rings.believed)
    tell("what the supposed effects would do", 0.4)
    signatures = [signature_of(effect, ground.model, camera, ground.at) for effect in effects]
    weighed = explained(ground, signatures, settings.belief)
    ground, explanations = weighed.ground, weighed.explanations
    _refuse_idle(signatures, explanations)
    rounds = _ROUNDS[settings.effort]
    tell("refitting with them", 0.5)
    best, plain = refitted(ground, explanations, effects, rounds), Refit.plain(ground)
    evidence, of_each = log_evidence(ground, best), {}
    for number, effect in enumerate(effects):
        tell(f"refitting without {effect.name.replace('_', ' ')}", 0.6 + 0.3 * number / len(effects))
        others = [other for other in effects if other is not effect]
        without = refitted(ground, explanations, others, rounds) if others else plain
        of_each[effect.name] = evidence - log_evidence(ground, without)
    tell("held-out swims", 0.9)
    pair = [tuple(swum(ground, fitted, fit.effects, fit.at, fit.values)) for fit in (plain, best)]
    gap = HeldOut(ground, tuple(held), settings.seed).gap(best)
    return Supposition(best, evidence - log_evidence(ground, plain), of_each, (pair[0], pair[1]), gap)


def _refuse_idle(signatures: Sequence[Signature], explanations: Explanations) -> None:
    """Effects without a form: nothing to refit."""
    faults = []
    for signature, form in zip(signatures, explanations.best, strict=True):
        if form is None:
            stands = np.isfinite(signature.rows).all(axis=1).any()
            why = "changes nothing in the fitted swims" if stands else "makes the twin diverge at every strength tried"
            faults.append(f"{signature.effect.name} {why}")
    if faults:
        raise NotEnoughData(f"{'; '.join(faults)}: leave it out, or fit swims in which it shows")
