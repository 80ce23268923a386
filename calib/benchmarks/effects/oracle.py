"""What somebody who knows the effect could make of a session: how far its gap shrinks on held-out swims."""

from collections.abc import Sequence

from scipy.linalg import solve_triangular

from calib.benchmarks.effects.rows import Change, SessionRows, camera_of, told_by
from fitting.signatures import signature_of
from swimmer.effects import Effect


def oracle_shrinkage(
    effects: Sequence[Effect], fitted: SessionRows, held_out: SessionRows, changes: Sequence[tuple[Change, Change]]
) -> float:
    """S = 1 - L_with / L_plain on held-out swims, both refitted on the fitted ones; no noise, so no floor.

    Args:
        effects: that are present, in the twin's own form.
        fitted: rows of the fitted swims.
        held_out: rows of the others, at the coefficients of the fitted ones.
        changes: that the effects, as they truly are, make of both, seen from the same coefficients, from one or more.
    """
    camera, at = camera_of(fitted.drawn), fitted.coefficients

    def squares_with(chosen: Sequence[Effect]) -> float:
        signatures = fitted.signatures({effect.name: effect for effect in chosen})
        number, told = told_by([change for change, _ in changes], signatures)
        change, held = changes[number]
        left, held_left = change.row.copy(), held.row.copy()
        for effect, value in zip(chosen, told.values, strict=True):
            left -= signature_of(effect, fitted.model, camera, at, value[None]).rows[0]
            held_left -= signature_of(effect, held_out.model, camera, at, value[None]).rows[0]
        refitted = held_left - held.space.slopes @ change.space.coefficients(left)
        return float((solve_triangular(held.space.root, refitted, lower=True) ** 2).sum())

    return float(1 - squares_with(effects) / squares_with(()))
