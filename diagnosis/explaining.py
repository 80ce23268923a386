"""All hypotheses of what the nearest plain twin leaves, and how large the twin's own error is beside them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, softmax

from diagnosis.constants import SCALES, SUSPECTED, UNLIKELY
from diagnosis.evidence import Hypotheses, Priors
from diagnosis.forms import shown
from diagnosis.ground import Ground
from diagnosis.local_discrepancies import LocalDiscrepancy
from diagnosis.probabilities import Hypothesis, Probabilities
from diagnosis.row import NONE, Row
from fitting.signatures import Signature


@dataclass(frozen=True, eq=False)
class Explained:
    """What stands beside the nearest plain twin.

    Attributes:
        ground: with the likeliest of the twin's own errors.
        hypotheses: of that.
        of_errors: of each error that is likely enough, its probability and the hypotheses there.
    """

    ground: Ground
    hypotheses: Hypotheses
    of_errors: tuple[tuple[float, Hypotheses], ...]

    @cached_property
    def probabilities(self) -> Probabilities:
        """Of all that there may be, whatever the size: where two are as likely, a gap of the smaller may be none."""
        return Probabilities.averaged([(chance, Probabilities.after(found)) for chance, found in self.of_errors])


def explained(
    ground: Ground,
    signatures: Sequence[Signature],
    priors: Priors,
    elsewhere: Sequence[LocalDiscrepancy] = (),
    beside: tuple[float, ...] = (0.0,),
) -> Explained:
    """All hypotheses, beside every error that the twin itself may have in this session.

    That is of one of several sizes; and of the likeliest of these it may look far more than usual like an effect that
    is suspected.

    A size is likely beside whatever there is, nothing or one effect or something else: so a gap does not make the error
    large. Something else at one place does not count in this: the twin's own error, where it is large, is at some place
    too.

    Args:
        ground: as fitted.
        signatures: of the catalogue.
        priors: before the session.
        elsewhere: what something else might do at one place.
        beside: log Bayes factors of what shows beside the beat.
    """
    known = ground.discrepancy

    def weighed(scale: float, far_more: str = "") -> _Weighed:
        here = ground.with_error(scale, known.alike(signatures, far_more))
        found = replace(_explanations(here, signatures, priors, elsewhere), beside=beside)
        return _Weighed(here, found, _simple(found))

    of_each = [weighed(scale) for scale in SCALES]
    logs = [each.log_likelihood + np.log(chance) for each, chance in zip(of_each, SCALES.values(), strict=True)]
    best = int(np.argmax(logs))
    suspects = [name for name in of_each[best].suspects if any(known.strengths.get(name, ()))]
    seldom = {name: known.heavy[name][1] for name in suspects if name in known.heavy}
    of_usual = logsumexp(logs) - np.log(1 - sum(seldom.values()))
    for name, chance in seldom.items():  # as much likelier than the usual as at the likeliest size
        of_each.append(weighed(list(SCALES)[best], name))
        gained = of_each[-1].log_likelihood - of_each[best].log_likelihood
        logs.append(float(of_usual + np.log(chance) + gained))
    chances = softmax(logs)
    chances = np.where(chances > UNLIKELY, chances, 0.0) / chances[chances > UNLIKELY].sum()
    of_errors = tuple((float(chance), each.found) for chance, each in zip(chances, of_each, strict=True) if chance)
    likeliest = of_each[likeliest_error(chances, len(SCALES))]
    return Explained(likeliest.ground, likeliest.found, of_errors)


def likeliest_error(chances: np.ndarray, sizes: int) -> int:
    """The place of the likeliest size among those that come first, unless a kind after them is likelier than all."""
    usual, seldom = np.split(chances, [sizes])
    return sizes + int(np.argmax(seldom)) if seldom.max(initial=0.0) > usual.sum() else int(np.argmax(usual))


@dataclass(frozen=True, eq=False)
class _Weighed:
    """Beside one error of the twin.

    Attributes:
        ground: with it.
        found: all hypotheses.
        simple: log probability, but for a constant, of nothing, of something else and of each effect by itself.
    """

    ground: Ground
    found: Hypotheses
    simple: dict[Hypothesis, float]

    @property
    def log_likelihood(self) -> float:
        """Of the row."""
        return float(logsumexp(list(self.simple.values()))) + self.ground.space.log_volume

    @property
    def suspects(self) -> list[str]:
        """Effects that are likely enough by themselves."""
        total = logsumexp(list(self.simple.values()))
        likely = [key for key, log in self.simple.items() if log - total > np.log(SUSPECTED)]
        return [self.found.effects[i].name for key in likely for i in key.present]


def _simple(found: Hypotheses) -> dict[Hypothesis, float]:
    alone = [Hypothesis((i,)) for i, each in enumerate(found.effects) if each.ways]
    count = len(found.effects)
    return {
        key: found.evidence(key.present, key.other) + found.priors.log_prior(len(key.present), key.other, count)
        for key in (Hypothesis(()), Hypothesis((), other=True), *alone)
    }


def _explanations(
    ground: Ground, signatures: Sequence[Signature], priors: Priors, elsewhere: Sequence[LocalDiscrepancy]
) -> Hypotheses:
    effects = shown(signatures, ground.space)
    features = len(ground.model.measured)
    frequencies = slice(features, features + ground.model.frequencies)
    wrong, like_any, loose = (
        Row.of(ground.space, ground.left, ground.generic, like, but)
        for like, but in ((effects, NONE), (effects, frequencies), ((), NONE))
    )
    places = tuple((each.weight, ground.space.freed(each.columns.T).T) for each in elsewhere)

    def lacking(effect: int) -> Row:
        others = [each for number, each in enumerate(effects) if number != effect]
        return Row.of(ground.space, ground.left, ground.generic, others, frequencies)

    numbers = slice(features, features + ground.model.beside)
    return Hypotheses((wrong, like_any, loose), effects, priors, numbers, places, lacking=lacking)
