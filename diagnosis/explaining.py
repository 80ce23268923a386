"""All hypotheses of what the fitted twin leaves, averaged over how large its own discrepancy is in this session."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from diagnosis.constants import MIXED, NEEDED, SCALES
from diagnosis.effect_response import effect_responses
from diagnosis.evidence import Hypotheses, Priors, Residual, gaussian_evidence
from diagnosis.linear_model import LinearModel
from diagnosis.local_discrepancies import LocalDiscrepancy
from diagnosis.probabilities import Probabilities, Weighed, posterior
from fitting.signatures import Signature


class Explained(NamedTuple):
    """What may explain the residual.

    Attributes:
        linear: with the likeliest size of the twin's own discrepancy.
        hypotheses: of that.
        probabilities: averaged over the size.
    """

    linear: LinearModel
    hypotheses: Hypotheses
    probabilities: Probabilities


def explained(
    linear: LinearModel,
    signatures: Sequence[Signature],
    priors: Priors,
    places: Sequence[LocalDiscrepancy] = (),
    non_periodic: tuple[float, ...] = (0.0,),
) -> Explained:
    """Weighs all hypotheses, for every size that the twin's own discrepancy may have.

    Args:
        linear: as fitted.
        signatures: of the catalogue.
        priors: before the session.
        places: where an unknown effect may act.
        non_periodic: log Bayes factors of what shows apart from the beat.
    """
    common, found = linear.discrepancy.common_columns(signatures), []
    for scale, chance in SCALES.items():
        here = linear.with_error(scale, common)
        hypotheses = _hypotheses(here, signatures, priors, places, non_periodic)
        weighed = Weighed.of(hypotheses)
        assumed = float(np.log(chance)) + here.space.log_volume
        found.append((assumed + logsumexp(list(weighed.logs.values())), assumed, here, hypotheses, weighed))
    _, _, likeliest, hypotheses, _ = max(found, key=lambda each: each[0])
    probabilities = posterior([(each[1], each[4]) for each in found], hypotheses)
    most = max(probabilities.of, key=lambda key: probabilities.of[key])
    needed = needed_in_mixture(likeliest, hypotheses, most.present) if most.other else ()
    return Explained(likeliest, hypotheses, probabilities.with_needed(needed))


def needed_in_mixture(linear: LinearModel, hypotheses: Hypotheses, present: Sequence[int]) -> tuple[int, ...]:
    """Effects without which a random mixture of the catalogue is much worse.

    An unknown effect that is clearly such a mixture is many effects at once, and naming one gains nothing beside all of
    them. But the mixture without that one may be much worse.

    Args:
        linear: with the discrepancy of the hypotheses.
        hypotheses: of the residual.
        present: effects beside the mixture.
    """
    responses = [each for each in (hypotheses.best[i] for i in present) if each is not None]

    def evidence(residual: Residual) -> float:
        return gaussian_evidence(residual, responses, True, hypotheses.priors.form_error).evidence

    mixed, found = evidence(hypotheses.like_any), []
    if mixed - evidence(hypotheses.loose) < MIXED:
        return ()
    features = len(linear.model.measured)
    frequencies = slice(features, features + linear.model.frequencies)
    for effect, each in enumerate(hypotheses.effects):
        if each.ways and effect not in present:
            others = [other for other in hypotheses.effects if other is not each]
            without = Residual.of(linear.space, linear.residual, linear.generic, others, frequencies)
            if mixed - evidence(without) >= NEEDED:
                found.append(effect)
    return tuple(found)


def _hypotheses(
    linear: LinearModel,
    signatures: Sequence[Signature],
    priors: Priors,
    places: Sequence[LocalDiscrepancy],
    non_periodic: tuple[float, ...],
) -> Hypotheses:
    effects, features = effect_responses(signatures, linear.space), len(linear.model.measured)
    frequencies = slice(features, features + linear.model.frequencies)
    return Hypotheses(
        like_any=Residual.of(linear.space, linear.residual, linear.generic, effects, frequencies),
        loose=Residual.of(linear.space, linear.residual, linear.generic),
        effects=effects,
        priors=priors,
        not_features=slice(features, features + linear.model.beside),
        places=tuple((each.weight, linear.space.projected(each.columns.T).T) for each in places),
        non_periodic=non_periodic,
    )
