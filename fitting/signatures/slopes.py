"""How a row changes with one parameter of an effect, piece by piece: effects are seldom linear.

An effect was tried at a few strengths, and what it does to the row over its strength, the slope of a chord, is taken to
be right about that strength. Nearer to nothing the slope goes on as it changes from the other side of nothing, or, for
a parameter with one sign, as it changes beyond; where it changes only across nothing it has a kink there, and stays.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from fitting.signatures.signature import Signature

_LITTLE = 0.3  # of the least strength that was tried: where the slope of little strengths is taken
_TOLD_APART = 2  # parameters of an effect


class Piece(NamedTuple):
    """One stretch of strengths.

    Attributes:
        low, high: its ends, of the sign of the stretch or zero, in the unit of the parameter.
        slope: (k,) by how much the row changes, over the strength; m, m/s or Hz for one of that unit.
    """

    low: float
    high: float
    slope: np.ndarray


def pieces(signature: Signature, parameter: int) -> tuple[Piece, ...]:
    """Of all strengths of one parameter that its bounds allow, the lowest first; empty where no try stood."""
    bounds = signature.effect.parameters[parameter]
    tried = _tried(signature, parameter)
    found: list[Piece] = []
    for sign, end in ((-1.0, bounds.low), (1.0, bounds.high)):
        own = {sign * value: slope for value, slope in tried.items() if sign * value > 0}
        other = {-sign * value: slope for value, slope in tried.items() if sign * value < 0}
        if sign * end <= 0:
            continue
        if own:
            side = _side(own, other, sign * end)
        elif other:  # it did not stand on this side: as on the other
            side = [Piece(0.0, sign * end, _about_zero(other, own))]
        else:
            continue
        found += side if sign > 0 else [Piece(-piece.high, -piece.low, piece.slope) for piece in side]
    return tuple(sorted(found, key=lambda piece: piece.low))


def little(signature: Signature, parameter: int) -> np.ndarray | None:
    """(k,) slope of little strengths, either way alike where both are allowed; None where no try stood."""
    near = [piece.slope for piece in pieces(signature, parameter) if piece.low <= 0 <= piece.high]
    return np.asarray(np.mean(near, axis=0)) if near else None


def ways(signature: Signature) -> list[dict[int, Piece]]:
    """All choices of one piece of each parameter that shows, by its number.

    Of an effect of more than two parameters, of which there would be too many, two: for all strengths the slopes of the
    least, and of the largest that were tried.
    """
    every = {number: pieces(signature, number) for number in range(signature.values.shape[1])}
    every = {number: own for number, own in every.items() if own}
    if len(every) <= _TOLD_APART:
        return [dict(zip(every, chosen, strict=True)) for chosen in product(*every.values())]
    return [{number: _whole(own, size) for number, own in every.items()} for size in (min, max)]


def _whole(own: Sequence[Piece], size: Callable[..., Piece]) -> Piece:
    """All strengths with the slope of the least or the largest."""
    like = size(own, key=lambda piece: max(piece.low, -piece.high))
    return Piece(own[0].low, own[-1].high, like.slope)


def _side(own: dict[float, np.ndarray], other: dict[float, np.ndarray], end: float) -> list[Piece]:
    """The pieces of one side, strengths counted from zero."""
    sizes = sorted(own)
    slopes = [_about_zero(own, other), *(own[size] for size in sizes)]
    places = [_LITTLE * sizes[0], *sizes]
    edges = [0.0, *(min(float(np.sqrt(a * b)), end) for a, b in pairwise(places)), end]
    found = (Piece(low, high, slope) for (low, high), slope in zip(pairwise(edges), slopes, strict=True))
    return [piece for piece in found if piece.low < piece.high]


def _about_zero(own: dict[float, np.ndarray], other: dict[float, np.ndarray]) -> np.ndarray:
    """(k,) slope of little strengths on one side."""
    sizes = sorted(own)
    first = own[sizes[0]]
    beyond = own[sizes[1]] - first if len(sizes) > 1 else None
    way = (1 - _LITTLE) * sizes[0]
    if other:
        across = first - other[min(other)]
        if beyond is None:
            share = 1.0
        else:
            expected = float(np.linalg.norm(across)) * (sizes[1] - sizes[0]) / (sizes[0] + min(other))
            share = min(float(np.linalg.norm(beyond)) / max(expected, 1e-300), 1.0)
        return np.asarray(first - share * across * way / (sizes[0] + min(other)))
    if beyond is None:
        return first
    return np.asarray(first - beyond * way / (sizes[1] - sizes[0]))


def _tried(signature: Signature, parameter: int) -> dict[float, np.ndarray]:
    """Slope of each chord by strength, of those tries of this parameter alone that stood."""
    found = {}
    for values, row in zip(signature.values, signature.rows, strict=True):
        strength = float(values[parameter])
        if strength and np.isfinite(row).all() and np.count_nonzero(values) == 1:
            found[strength] = row / strength
    return found
