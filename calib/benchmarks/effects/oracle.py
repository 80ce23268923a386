"""What somebody who knows the effect could make of a session: how far its gap shrinks on held-out swims."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from calib.benchmarks.effects.rows import Change, SessionRows, camera_of
from fitting.signatures import Whitened, signature_of
from swimmer.effects import Effect


def oracle_shrinkage(
    effects: Sequence[Effect], fitted: SessionRows, held_out: SessionRows, change: Change, held_change: Change
) -> float:
    """S = 1 - L_with / L_plain on held-out swims, both refitted on the fitted ones; no noise, so no floor.

    Args:
        effects: that are present, in the twin's own form.
        fitted: rows of the fitted swims.
        held_out: rows of the others, at the coefficients of the fitted ones.
        change, held_change: by which the effects, as they truly are, move both, about the same coefficients.
    """
    camera, at = camera_of(fitted.drawn), fitted.coefficients
    signatures = [signature_of(effect, fitted.model, camera, at) for effect in effects]
    values, _ = change.space.together(change.row, signatures)
    told, held_told = change.row.copy(), held_change.row.copy()
    for effect, value in zip(effects, values, strict=True):
        told -= signature_of(effect, fitted.model, camera, at, value[None]).rows[0]
        held_told -= signature_of(effect, held_out.model, camera, at, value[None]).rows[0]
    plain, left = (
        _squares(held_change.space, row - held_change.space.slopes @ change.space.coefficients(seen))
        for row, seen in ((held_change.row, change.row), (held_told, told))
    )
    return float(1 - left / plain)


def _squares(space: Whitened, row: np.ndarray) -> float:
    """Of a row, whitened."""
    return float((solve_triangular(space.root, row, lower=True) ** 2).sum())
