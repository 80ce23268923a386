"""What somebody who knows the effect could make of a session: how far its gap shrinks on held-out swims."""

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.effects.rows import SessionRows, told_by
from benchmarks.reality import Recording
from diagnosis.refit import left_with, refit
from swimmer.effects import Effect

_ROUNDS = 8
_SHOWS = 1.0  # squared standard deviations that the plain twin must leave of all held-out gaits


def oracle_shrinkage(
    effects: Sequence[Effect], fitted: SessionRows, held_out: SessionRows, recordings: Mapping[str, Recording]
) -> float | None:
    """S = 1 - L_with / L_plain of gaits of held-out swims, both twins refitted on the fitted ones with the simulation.

    Of all that a diagnosis counts, course and sliding too. Nothing has noise, and what is left of the base state is
    taken off, so there is no floor. None where a twin diverges, or the effects leave held-out gaits as they are.

    Args:
        effects: that are present, in the twin's own form.
        fitted: rows of the fitted swims.
        held_out: rows of the others, at the coefficients of the fitted ones.
        recordings: of all swims with the effects, as they truly are, by name.
    """
    try:
        at = fitted.refitted(recordings)
        _, told = told_by(fitted.changes(recordings), fitted.signatures({effect.name: effect for effect in effects}))
        best = refit(fitted.ground(recordings, at), effects, np.concatenate(told.values), _ROUNDS)
        beside = held_out.ground(recordings, at)
        plain, left = (float((beside.whitened_swims(row) ** 2).sum()) for row in (beside.left, left_with(beside, best)))
    except (np.linalg.LinAlgError, ValueError):  # a twin diverged, and what it leaves is not finite
        return None
    return 1 - left / plain if plain > _SHOWS else None
