"""All explanations of what the nearest plain twin leaves, and how large the twin's own error is beside them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, softmax

from diagnosis.evidence import Belief, Explanations
from diagnosis.forms import shown
from diagnosis.ground import Ground
from diagnosis.probabilities import Probabilities
from diagnosis.row import Row
from diagnosis.strangers import Stranger
from fitting.signatures import Signature

SCALES = {0.7: 0.3, 1.0: 0.45, 1.4: 0.18, 2.0: 0.07}
"""Of the twin's own error in a session, against most sessions, with the probability of each before it is looked at.

As in base sessions of the benchmark, with larger ones taken to be somewhat likelier than there.
"""
_UNLIKELY = 0.02  # of a size: it counts no more


@dataclass(frozen=True, eq=False)
class Explained:
    """What stands beside the nearest plain twin.

    Attributes:
        ground: with the likeliest size of the twin's own error.
        explanations: of that.
        of_sizes: of each size that is likely enough, its probability and the explanations there.
    """

    ground: Ground
    explanations: Explanations
    of_sizes: tuple[tuple[float, Explanations], ...]

    @cached_property
    def probabilities(self) -> Probabilities:
        """Of all that there may be, whatever the size: where two are as likely, a gap of the smaller may be none."""
        return Probabilities.averaged([(chance, Probabilities.after(found)) for chance, found in self.of_sizes])


def explained(
    ground: Ground,
    signatures: Sequence[Signature],
    belief: Belief,
    elsewhere: Sequence[Stranger] = (),
    beside: tuple[float, ...] = (0.0,),
) -> Explained:
    """All explanations, at every size that the twin's own error may have in this session.

    A size is likely beside whatever there is, nothing or one effect or something else: so a gap does not make the error
    large. Something else at one place does not count in this: the twin's own error, where it is large, is at some place
    too.

    Args:
        ground: as fitted.
        signatures: of the catalogue.
        belief: before the session.
        elsewhere: what something else might do at one place.
        beside: log Bayes factors of what shows beside the beat.
    """
    alike = ground.discrepancy.alike(signatures)
    logs, of_each = [], []
    for scale, chance in SCALES.items():
        here = ground.with_error(scale, alike)
        found = replace(_explanations(here, signatures, belief, elsewhere), beside=beside)
        sets = [((), False), ((), True), *(((i,), False) for i, each in enumerate(found.effects) if each.ways)]
        of_sets = [found.evidence(s, other) + belief.log_prior(len(s), other, len(signatures)) for s, other in sets]
        logs.append(float(logsumexp(of_sets)) + here.space.log_volume + np.log(chance))
        of_each.append((here, found))
    chances = softmax(logs)
    chances = np.where(chances > _UNLIKELY, chances, 0.0) / chances[chances > _UNLIKELY].sum()
    of_sizes = tuple((float(chance), found) for chance, (_, found) in zip(chances, of_each, strict=True) if chance)
    return Explained(*of_each[int(np.argmax(chances))], of_sizes)


def _explanations(
    ground: Ground, signatures: Sequence[Signature], belief: Belief, elsewhere: Sequence[Stranger]
) -> Explanations:
    ends = len(ground.generic)
    effects = shown(signatures, ground.space, _gaits(ground) if elsewhere else ())
    wrong, like_any, loose = (
        Row.of(ground.space, ground.left, ground.generic, like, frequencies)
        for like, frequencies in ((effects, 0), (effects, ground.model.frequencies), ((), 0))
    )
    places = tuple((each.weight, ground.space.freed(each.columns.T).T) for each in elsewhere)

    def lacking(effect: int) -> Row:
        others = [each for number, each in enumerate(effects) if number != effect]
        return Row.of(ground.space, ground.left, ground.generic, others, ground.model.frequencies)

    frequencies = slice(ends - ground.model.frequencies, ends)
    return Explanations((wrong, like_any, loose), effects, belief, frequencies, places, lacking=lacking)


def _gaits(ground: Ground) -> list[slice]:
    """Where the row holds that of each trial."""
    count = len(ground.trials)
    own = (len(ground.generic) - ground.model.frequencies) // count
    return [slice(own * number, own * (number + 1)) for number in range(count)]
