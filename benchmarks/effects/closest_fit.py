"""Fit of several effects together to a change of a row: how close they come within their bounds."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from fitting.signatures import Piece, Signature, Whitened, pieces

_MAX_FREE_PARAMETERS = 2  # An effect of more parameters would have too many choices of pieces.


class ClosestFit(NamedTuple):
    """Closest fit of several effects, or of none."""

    values: list[np.ndarray]  # (p,) parameters of each effect
    distance: float  # whitened, coefficients refitted; d in the two-way error Phi(-d / 2)
    residual: np.ndarray  # (k,) residual of the row without the effects, coefficients as they were


def closest_fit_of(space: Whitened, row: np.ndarray, signatures: Sequence[Signature]) -> ClosestFit:
    """Fit the parameters of effects that together come nearest to a change (k,), within their bounds.

    Each parameter is linear over each of its pieces; those of all effects that come nearest are taken.
    """
    target = space.projected(row)
    best, residual = [np.zeros(len(each.effect.parameters)) for each in signatures], row
    nearest = float(np.linalg.norm(target))
    choices = [chosen for chosen in product(*map(_list_choices, signatures)) if any(chosen)]
    every = {id(piece): piece for chosen in choices for way in chosen for piece in way.values()}
    if not every:
        return ClosestFit(best, nearest, residual)
    basis, columns = np.linalg.qr(space.projected(np.array([piece.slope for piece in every.values()])).T)
    column = dict(zip(every, columns.T, strict=True))
    within = basis.T @ target
    beside = max(nearest**2 - float(within @ within), 0.0)
    for chosen in choices:
        own = [piece for way in chosen for piece in way.values()]
        bounds = ([piece.low for piece in own], [piece.high for piece in own])
        found = lsq_linear(np.column_stack([column[id(piece)] for piece in own]), within, bounds)
        distance = float(np.sqrt(2 * found.cost + beside))
        if distance < nearest:
            nearest, values = distance, iter(found.x)
            residual = row - np.column_stack([piece.slope for piece in own]) @ found.x
            for each, way in zip(best, chosen, strict=True):
                each[:] = 0.0
                each[list(way)] = [next(values) for _ in way]
    return ClosestFit(best, nearest, residual)


def _list_choices(signature: Signature) -> list[dict[int, Piece]]:
    """List all choices of one piece of each parameter that shows, by its number.

    Of an effect of more than two parameters, of which there would be too many, two: for all strengths the slopes of the
    least, and of the largest that were tried.
    """
    every = {number: pieces(signature, number) for number in range(signature.values.shape[1])}
    every = {number: own for number, own in every.items() if own}
    if len(every) <= _MAX_FREE_PARAMETERS:
        return [dict(zip(every, chosen, strict=True)) for chosen in product(*every.values())]
    return [{number: _merge_pieces(own, size) for number, own in every.items()} for size in (min, max)]


def _merge_pieces(own: Sequence[Piece], size: Callable[..., Piece]) -> Piece:
    """Return one piece for all strengths, with the slope of the least or the largest."""
    like = size(own, key=lambda piece: max(piece.low, -piece.high))
    return Piece(own[0].low, own[-1].high, like.slope)
