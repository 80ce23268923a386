"""Weights of single changes since a reference, after the likeliest ones were refitted by simulation.

A strong change is not linear in its strength. The few likeliest effects are therefore refitted, and weighed by what
they leave: normal noise, an unknown effect besides, and the effect's form error, a share of each part of what it
explains and the same share without structure:

    I + e^2 F F' + (e^2 |F|^2 + u^2) G,        F: the parts of the refitted response

with e and u averaged over their grids, and strengths by Laplace's approximation (MacKay 2003, chapter 28). At most one
effect changed: two that act together are `unexplained`, or the stronger one beside something else.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from diagnosis.evidence import Hypotheses, covariances_of_rest
from diagnosis.hypotheses import Hypothesis, Probabilities
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit

_REFITTED = 4  # effects that are refitted, the likeliest


def candidates(hypotheses: Hypotheses) -> tuple[str, ...]:
    """Return the effects to refit: those that alone are likeliest, with or without an unknown one."""
    shows = [i for i, each in enumerate(hypotheses.effects) if each.linear]
    weight = {i: max(hypotheses.evidence((i,), other) for other in (False, True)) for i in shows}
    return tuple(hypotheses.effects[i].name for i in sorted(shows, key=lambda i: -weight[i])[:_REFITTED])


def weigh_refits(
    linear: LinearModel,
    hypotheses: Hypotheses,
    found: Probabilities,
    refitting: Callable[[Sequence[str]], Refit],
) -> tuple[Probabilities, Mapping[str, Refit]]:
    """Weigh single changes anew; how probable any change is stays.

    Args:
        linear: the linearised model of the changed session.
        hypotheses: its hypotheses.
        found: their probabilities by linear responses.
        refitting: refits the twin with named effects.

    Returns:
        The probabilities, and the refits by the effect's name.
    """
    refits = {name: refitting([name]) for name in candidates(hypotheses)}
    every, priors = len(hypotheses.effects), hypotheses.priors
    logs = {}
    for each in found.of:
        if each.present or each.other:
            names = [found.names[i] for i in each.present]
            evidence = (
                evidence_of(linear, hypotheses, refits[names[0]], each.other)
                if names and names[0] in refits
                else hypotheses.evidence(each.present, each.other)
            )
            logs[each] = evidence + priors.log_prior(len(each.present), each.other, every)
    odds = found.look_alike
    if odds is not None:
        logs = {key: log + float(np.log1p(odds[int(key.other), list(key.present)]).sum()) for key, log in logs.items()}
    total, rest = logsumexp(list(logs.values())), 1 - found.null
    chances = {key: rest * float(np.exp(log - total)) for key, log in logs.items()}
    return Probabilities(found.names, {Hypothesis(()): found.null} | chances, found.at_place, odds), refits


def evidence_of(linear: LinearModel, hypotheses: Hypotheses, fit: Refit, other: bool) -> float:
    """Return the log evidence of a refitted twin, comparable with `Hypotheses.evidence`.

    Args:
        linear: the linearised model.
        hypotheses: its hypotheses.
        fit: the refitted twin.
        other: whether there is an unknown effect besides.
    """
    seen, priors = hypotheses.like_any, hypotheses.priors
    response = linear.residual - fit.residual
    left = seen.turn @ linear.space.projected(fit.residual)
    form = seen.turn @ linear.space.projected(linear.parts * response).T  # (q, g)
    size = float(np.linalg.norm(linear.space.projected(response)))
    found = [
        -0.5 * (float(rest.products(left[:, None])[0, 0]) + rest.volume)
        for rest in covariances_of_rest(seen, form, size, priors, other)
    ]
    sd = np.array([parameter.sd for effect in fit.effects for parameter in effect.parameters])
    width = sd * max(1.0, float(np.sqrt(np.mean((fit.values / sd) ** 2))))
    known = np.sqrt(np.diag(fit.covariance))[len(fit.at) :]
    occam = float(np.log(np.minimum(known / width, 1.0)).sum()) - 0.5 * float(((fit.values / width) ** 2).sum())
    return float(logsumexp(found) - np.log(len(found))) + occam
