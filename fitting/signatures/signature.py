"""Signature of an effect: how much it moves what a session measured, and how that changes with one parameter.

An effect was tried at a few strengths, and its change of the row over its strength, the slope of a chord, is taken to
be right about that strength. Nearer to zero the slope goes on as it changes from the other side of zero, or, for a
parameter with one sign, as it changes beyond; where it changes only across zero it has a kink there, and stays.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fitting.model.session_model import SessionModel
from fitting.signatures.affected_session import AffectedSession, plain_features
from session import CameraSpec
from swimmer.effects import Effect

STRENGTHS = (-3.0, -1.0, 1.0, 3.0)  # standard deviations of a parameter's prior
_LITTLE = 0.3  # share of the least strength tried at which the slope of small strengths is taken


@dataclass(frozen=True, eq=False)
class Signature:
    """Signature of one effect on trials whose features form a row of length k, followed by b further numbers.

    Attributes:
        effect: the effect, with the parameters that these trials' markers give it.
        values: (q, p) strengths that were tried.
        features: (q, k) change of the row of features; nan where the twin diverged.
        beside: (q, b) change of what the trials' commands lead to, as filmed and as logged, Hz, and of how decays ring.
    """

    effect: Effect
    values: np.ndarray
    features: np.ndarray
    beside: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """Changes of the whole row, (q, k + b)."""
        return np.hstack([self.features, self.beside])


def signature_of(
    effect: Effect,
    model: SessionModel,
    camera: CameraSpec,
    coefficients: np.ndarray,
    values: np.ndarray | None = None,
) -> Signature:
    """Compute the signature of an effect on the trials of a session, against the plain twin.

    An effect of no strength is the plain twin (see `Effect`): one that is not would have a part that never changes.

    Args:
        effect: the effect, of the catalogue or of a user.
        model: the trials with the plain twin.
        camera: the camera that filmed them.
        coefficients: (5,) of the twin.
        values: (q, p) strengths; by default each parameter alone, one and three standard deviations of its prior either
            way, as far as its bounds allow.
    """
    session = AffectedSession.of([effect], model, camera, coefficients)
    suited = session.effects[0]
    values = strengths(suited) if values is None else values
    plain = plain_features(model, camera, tuple(map(float, coefficients)))
    rows = (
        session.features(np.tile(coefficients, (len(values), 1)), values) if len(values) else np.zeros((0, len(plain)))
    )
    return Signature(suited, values, rows - plain, session.beside(values))


def strengths(effect: Effect) -> np.ndarray:
    """Return the strengths to try (q, p): each parameter alone, in sizes `STRENGTHS` as far as its bounds allow."""
    rows = []
    for number, parameter in enumerate(effect.parameters):
        for size in STRENGTHS:
            value = float(np.clip(size * parameter.sd, parameter.low, parameter.high))
            if value != 0.0:
                rows.append(value * np.eye(len(effect.parameters))[number])
    return np.unique(rows, axis=0) if rows else np.zeros((0, len(effect.parameters)))


class Piece(NamedTuple):
    """Slope of an effect over one stretch of strengths.

    Attributes:
        low, high: ends of the stretch, of its sign or zero, in the unit of the parameter.
        slope: (k,) change of the row over the strength; m, m/s or Hz for one of that unit.
    """

    low: float
    high: float
    slope: np.ndarray


def pieces(signature: Signature, parameter: int) -> tuple[Piece, ...]:
    """Return the pieces of all strengths of one parameter that its bounds allow, the lowest first.

    There is none where the twin diverged at every strength.

    Args:
        signature: the signature.
        parameter: number of the parameter.
    """
    bounds = signature.effect.parameters[parameter]
    tried = _chord_slopes(signature, parameter)
    found: list[Piece] = []
    for sign, end in ((-1.0, bounds.low), (1.0, bounds.high)):
        own = {sign * value: slope for value, slope in tried.items() if sign * value > 0}
        other = {-sign * value: slope for value, slope in tried.items() if sign * value < 0}
        if sign * end <= 0:
            continue
        if own:
            side = _side(own, other, sign * end)
        elif other:  # it diverged on this side: as on the other
            side = [Piece(0.0, sign * end, _about_zero(other, own))]
        else:
            continue
        found += side if sign > 0 else [Piece(-piece.high, -piece.low, piece.slope) for piece in side]
    return tuple(sorted(found, key=lambda piece: piece.low))


def little(signature: Signature, parameter: int) -> np.ndarray | None:
    """Return the slope of small strengths (k,), averaged over both signs.

    Args:
        signature: the signature.
        parameter: number of the parameter.

    Returns:
        None where the twin diverged at every strength.
    """
    near = [piece.slope for piece in pieces(signature, parameter) if piece.low <= 0 <= piece.high]
    return np.asarray(np.mean(near, axis=0)) if near else None


def _side(own: dict[float, np.ndarray], other: dict[float, np.ndarray], end: float) -> list[Piece]:
    """Return the pieces of one side, strengths counted from zero."""
    sizes = sorted(own)
    slopes = [_about_zero(own, other), *(own[size] for size in sizes)]
    places = [_LITTLE * sizes[0], *sizes]
    edges = [0.0, *(min(float(np.sqrt(a * b)), end) for a, b in pairwise(places)), end]
    found = (Piece(low, high, slope) for (low, high), slope in zip(pairwise(edges), slopes, strict=True))
    return [piece for piece in found if piece.low < piece.high]


def _about_zero(own: dict[float, np.ndarray], other: dict[float, np.ndarray]) -> np.ndarray:
    """Return the slope of small strengths on one side, (k,)."""
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


def _chord_slopes(signature: Signature, parameter: int) -> dict[float, np.ndarray]:
    """Return the slope of each chord by strength, for this parameter alone, where the twin did not diverge."""
    found = {}
    for values, row in zip(signature.values, signature.rows, strict=True):
        strength = float(values[parameter])
        if strength and np.isfinite(row).all() and np.count_nonzero(values) == 1:
            found[strength] = row / strength
    return found
