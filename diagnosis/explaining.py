"""All explanations of what the nearest plain twin leaves, once it is known how large the twin's own error is here."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from diagnosis.evidence import Belief, Explanations
from diagnosis.forms import shown
from diagnosis.ground import Ground
from diagnosis.row import Row
from diagnosis.strangers import Stranger
from fitting.signatures import Signature

SCALES = {0.7: 0.3, 1.0: 0.45, 1.4: 0.18, 2.0: 0.07}
"""Of the twin's own error in a session, against most sessions, with the probability of each before it is looked at.

As in 25 base sessions of the benchmark, with larger ones taken to be somewhat likelier than there.
"""


def explained(
    ground: Ground, signatures: Sequence[Signature], belief: Belief, elsewhere: Sequence[Stranger] = ()
) -> tuple[Ground, Explanations]:
    """The ground with the likeliest size of the twin's own error, and all explanations of what stands beside it.

    Likeliest beside whatever there is, nothing or one effect or something else: so a gap does not make the error large.
    That there is nothing counts with all sizes.

    Args:
        ground: as fitted.
        signatures: of the catalogue.
        belief: before the session.
        elsewhere: what something else might do at one place.
    """
    alike = ground.discrepancy.alike(signatures)
    singles = [(number,) for number in range(len(signatures))]
    keys: list[tuple[tuple[int, ...], bool]] = [((), False), ((), True), *((single, False) for single in singles)]
    prior = np.array([belief.log_prior(len(present), other, len(signatures)) for present, other in keys])
    weighed = []
    for scale, chance in SCALES.items():
        here = ground.with_error(scale, alike)
        found = _explanations(here, signatures, belief, elsewhere)
        logs = np.array([found.evidence(present, other) for present, other in keys])
        likeliest = keys[int(np.argmax(logs + prior))][0]
        beside = [
            found.somewhere(present) + belief.log_prior(len(present), True, len(signatures)) + np.log(belief.placed)
            for present in {(), likeliest}
        ]
        volume = here.space.log_volume + np.log(chance)
        total = logsumexp([*(logs + prior), *np.concatenate(beside)]) + volume
        weighed.append(_Weighed(float(total), volume, logs, here, found))
    best = max(weighed, key=lambda each: each.total)
    nothing = float(logsumexp([each.logs[0] + each.volume for each in weighed])) - best.volume
    return best.ground, best.found.counting(nothing - float(best.logs[0]))


class _Weighed(NamedTuple):
    """One size of the twin's own error: log probability of all and of each explanation, and the volume between."""

    total: float
    volume: float
    logs: np.ndarray
    ground: Ground
    found: Explanations


def _explanations(
    ground: Ground, signatures: Sequence[Signature], belief: Belief, elsewhere: Sequence[Stranger]
) -> Explanations:
    ends = len(ground.generic)
    own = (ends - ground.model.frequencies) // len(ground.trials) if elsewhere else 0
    trials = [slice(own * number, own * (number + 1)) for number in range(len(ground.trials))] if elsewhere else []
    effects = shown(signatures, ground.space, trials)
    wrong, like_any, loose = (
        Row.of(ground.space, ground.left, ground.generic, like, frequencies)
        for like, frequencies in ((effects, 0), (effects, ground.model.frequencies), ((), 0))
    )
    places = tuple((each.weight, ground.space.freed(each.columns.T).T) for each in elsewhere)
    return Explanations((wrong, like_any, loose), effects, belief, slice(ends - ground.model.frequencies, ends), places)
