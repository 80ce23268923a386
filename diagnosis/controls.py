"""What a held-out gap would shrink by anyhow: with an effect that is not there, and with a correction without physics.

A name under which the gap shrinks no further than under these has not earned it.
"""

from collections.abc import Collection

import numpy as np

from diagnosis.constants import AGAINST
from diagnosis.evidence import Hypotheses
from diagnosis.generic import generic_size
from diagnosis.linear_model import LinearModel
from diagnosis.probabilities import Probabilities
from fitting.model.features import advanced
from fitting.model.session_model import SessionModel


def placebo_for(hypotheses: Hypotheses, probabilities: Probabilities, named: Collection[str]) -> str | None:
    """Of the effects that the evidence speaks against, the one that moves the fitted swims most.

    With as many parameters as the named ones have, or as near to that as there is.
    """
    count = sum(_parameters(hypotheses, i) for i, name in enumerate(probabilities.names) if name in named)
    found = []
    for i, (name, chance) in enumerate(zip(probabilities.names, probabilities.marginal, strict=True)):
        if hypotheses.best[i] is not None and name not in named and chance <= AGAINST:
            size = max(each.size for each in hypotheses.effects[i].linear)
            found.append((abs(_parameters(hypotheses, i) - count), -size, name))
    return min(found)[-1] if found else None


def _parameters(hypotheses: Hypotheses, effect: int) -> int:
    return max((len(each.parameters) for each in hypotheses.effects[effect].linear), default=0)


def carried_over(linear: LinearModel, held_out: LinearModel) -> np.ndarray:
    """(k,) what is left of other swims once what is left of the fitted ones is carried over to them (kriging).

    As much of it as is no noise: smooth along the body as a gap of no particular cause is, and alike in all swims as
    their beats go on; and what the twin leaves of swims alike where nothing is wrong. Masked markers tell nothing, and
    are not corrected.
    """
    features = len(linear.model.measured) // len(linear.trials)
    both = SessionModel((*linear.model.trials[: len(linear.swims)], *held_out.model.trials))
    scored, asked = linear.scored, held_out.scored
    others = len(linear.swims) * features + asked
    covariance, residual = linear.covariance[np.ix_(scored, scored)], linear.residual[scored]
    of_one = np.linalg.cholesky(linear.generic[:features, :features]).T
    of_all = np.hstack([advanced(of_one, float(phase)) for phase in both.phase_rad]).T
    common, of_others = of_all[scored], of_all[others]
    among = common @ common.T
    size = generic_size(residual, covariance, among)
    of_twin = linear.error**2 * linear.discrepancy.over(both)[np.ix_(others, scored)]
    result = np.array(held_out.residual)
    result[asked] -= (size**2 * of_others @ common.T + of_twin) @ np.linalg.solve(
        covariance + size**2 * among, residual
    )
    return result
