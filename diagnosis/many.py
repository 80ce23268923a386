"""Many effects at once, and which of them stand whatever the others do.

A robot in a pool may have a little of everything amiss. Then no set of a few effects explains what is left, and a gap
that is like a random mixture of what the whole catalogue does explains it far better than one with no structure. That
such a mixture holds an effect gains nothing by being said: it holds them all. What can be asked is whether it does as
well without: the mixture of all effects against that of all but one, whose ratio of evidences (a Bayes factor; Kass and
Raftery 1995) is how surely that one is among them.
"""

from collections.abc import Collection

from scipy.special import expit

from diagnosis.evidence import Hypotheses

_CLEARLY = 10.0  # log Bayes factor of a mixture against a gap without structure, from which its parts are looked at
_ODDS = -4.6  # logarithm of those of each effect to be in a mixture, before a session is looked at: one in a hundred
_STANDS = 0.9  # probability from which an effect is


def standing(hypotheses: Hypotheses, present: Collection[int]) -> dict[int, float]:
    """Probabilities of effects that are in a mixture of everything beside others, of those that surely are.

    Args:
        hypotheses: of a session.
        present: effects beside the mixture.
    """
    mixed, loose = hypotheses.mixed(tuple(present)), hypotheses.loose(tuple(present))
    if mixed - loose < _CLEARLY:
        return {}
    found = {}
    for effect, each in enumerate(hypotheses.effects):
        if each.ways and effect not in present:
            chance = float(expit(mixed - hypotheses.mixed(tuple(present), without=effect) + _ODDS))
            if chance >= _STANDS:
                found[effect] = chance
    return found
