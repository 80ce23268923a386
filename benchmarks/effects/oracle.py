"""What somebody who knows the effect could make of a session: how far its gap shrinks on held-out swims."""

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.effects.rows import SessionRows, closest_fit
from benchmarks.reality import Recording
from diagnosis.refit import left_with, refit
from swimmer.effects import Effect

_ROUNDS = 8
_SHOWS = 1.0  # squared standard deviations that the plain twin must leave of all held-out trials


def oracle_shrinkage(
    effects: Sequence[Effect], fitted: SessionRows, held_out: SessionRows, recordings: Mapping[str, Recording]
) -> float | None:
    """S = 1 - L_with / L_plain of held-out trials, both twins refitted on the fitted ones with the simulation.

    Of all features that a diagnosis uses, course and sliding too. Nothing has noise, and the residual of the base state
    is subtracted, so there is no floor. None where a twin diverges, or the effects do not change held-out trials.

    Args:
        effects: that are present, in the twin's own form.
        fitted: rows of the fitted swims.
        held_out: rows of the others, at the coefficients of the fitted ones.
        recordings: of all swims with the effects, as they truly are, by name.
    """
    try:
        at = fitted.refitted(recordings)
        _, start = closest_fit(
            fitted.changes(recordings), fitted.signatures({effect.name: effect for effect in effects})
        )
        best = refit(fitted.ground(recordings, at), effects, np.concatenate(start.values), _ROUNDS)
        held = held_out.ground(recordings, at)
        plain, rest = (float((held.whitened_swims(row) ** 2).sum()) for row in (held.left, left_with(held, best)))
    except (np.linalg.LinAlgError, ValueError):  # a twin diverged, and what it leaves is not finite
        return None
    return 1 - rest / plain if plain > _SHOWS else None
