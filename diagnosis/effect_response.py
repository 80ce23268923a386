"""Responses to effects: what each does to the whitened residual, linear over each range of its strengths.

`effect_responses` makes them from signatures (`fitting.signatures`): a `LinearResponse` for each range of strengths,
and an `EffectResponse` with all of one effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from fitting.signatures import Signature, Whitened, pieces

_SAME = 0.1  # relative difference up to which two slopes count as one
_SILENT = 1e-6  # norm of one standard deviation below which an effect does nothing


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """Response to an effect over one range of its strengths.

    Attributes:
        parameters: which of the effect's parameters, (p,) indices.
        columns: (q, p) in the whitened residual space, for one standard deviation of each parameter's prior.
        sd: (p,) standard deviations of the prior.
        low, high: (p,) ends of the range, in standard deviations.
        bounds: (2, p) ends of what the parameters may be at all.
        size: root mean square norm of the effect under its prior, the same for all its ranges.
        before_refit: that norm before coefficients are refitted, over `size`: the form error is a share of this.
        parts: (g, q, p) what it does to each part of the row alone; none where a form error has no parts.
    """

    parameters: tuple[int, ...]
    columns: np.ndarray
    sd: np.ndarray
    low: np.ndarray
    high: np.ndarray
    bounds: np.ndarray
    size: float
    before_refit: float
    parts: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))

    def nearest(self, target: np.ndarray, columns: np.ndarray | None = None) -> np.ndarray:
        """Return the strengths (p,) within bounds, in sd, that come nearest to a residual (q,).

        Args:
            target: (q,) the residual.
            columns: (q, p) in place of the response's own.
        """
        return np.asarray(lsq_linear(self.columns if columns is None else columns, target, tuple(self.bounds)).x)


@dataclass(frozen=True, eq=False)
class EffectResponse:
    """An effect with all its linear responses.

    Attributes:
        ways: alternatives, each with responses that cover all strengths: all parameters together, and, for an effect of
            several parameters, each alone.
    """

    name: str
    stage: str
    ways: tuple[tuple[LinearResponse, ...], ...]

    @property
    def linear(self) -> tuple[LinearResponse, ...]:
        """Linear responses of all ways."""
        return tuple(response for way in self.ways for response in way)

    @cached_property
    def slopes(self) -> np.ndarray:
        """Columns (q, s) of what each parameter alone does over each range, for one standard deviation."""
        alone = self.ways[1:] or self.ways
        return np.hstack([response.columns for way in alone for response in way])


def effect_responses(
    signatures: Sequence[Signature], space: Whitened, strongest: float = np.inf, parts: np.ndarray | None = None
) -> tuple[EffectResponse, ...]:
    """Return the responses of signatures, in their order.

    An effect that diverged or does nothing has no linear response.

    Args:
        signatures: what each effect does.
        space: the whitened residual space.
        strongest: largest strength, in standard deviations of the parameters' priors.
        parts: (g, k) which numbers of the row belong to each part whose size a form error changes by itself; default
            none.
    """
    parts = np.zeros((0, len(space.root))) if parts is None else parts
    return tuple(
        EffectResponse(each.effect.name, each.effect.stage, _ways(each, space, strongest, parts)) for each in signatures
    )


class _Range(NamedTuple):
    """One range of one parameter, in standard deviations.

    It has two ends, a column (q,), the column's norm before coefficients are refitted, and its parts (g, q).
    """

    low: float
    high: float
    column: np.ndarray
    before_refit: float
    parts: np.ndarray


def _ways(
    signature: Signature, space: Whitened, strongest: float, parts: np.ndarray
) -> tuple[tuple[LinearResponse, ...], ...]:
    every = {number: _ranges(signature, number, space, strongest, parts) for number in range(signature.values.shape[1])}
    every = {number: own for number, own in every.items() if own}
    alone = [tuple(_response(signature, {number: one}, [own]) for one in own) for number, own in every.items()]
    if len(alone) <= 1:
        return tuple(alone)
    together = {number: _whole(own) for number, own in every.items()}
    return ((_response(signature, together, list(every.values())),), *alone)


def _ranges(signature: Signature, number: int, space: Whitened, strongest: float, parts: np.ndarray) -> list[_Range]:
    """Return the ranges of one parameter; neighbours with the same slope are joined."""
    sd = signature.effect.parameters[number].sd
    most = strongest * sd
    within = [piece for piece in pieces(signature, number) if piece.low < most and piece.high > -most]
    all_pieces = [piece._replace(low=max(piece.low, -most), high=min(piece.high, most)) for piece in within]
    if not all_pieces:
        return []
    rows = sd * np.array([piece.slope for piece in all_pieces])
    columns, norms = space.projected(rows), np.linalg.norm(space.whitened(rows), axis=1)
    found: list[_Range] = []
    for piece, row, column, norm in zip(all_pieces, rows, columns, norms, strict=True):
        last = found[-1] if found else None
        if last is not None and np.linalg.norm(column - last.column) <= _SAME * np.linalg.norm(last.column):
            found[-1] = last._replace(high=piece.high / sd)
        else:
            of_parts = space.projected(parts * row) if len(parts) else np.zeros((0, len(column)))
            found.append(_Range(piece.low / sd, piece.high / sd, column, float(norm), of_parts))
    return found if any(np.linalg.norm(each.column) > _SILENT for each in found) else []


def _whole(ranges: Sequence[_Range]) -> _Range:
    """Return one range of all strengths, with the slope of the smallest."""
    least = min(ranges, key=lambda each: max(each.low, -each.high))
    return least._replace(low=ranges[0].low, high=ranges[-1].high)


def _response(signature: Signature, chosen: dict[int, _Range], every: Sequence[Sequence[_Range]]) -> LinearResponse:
    """Return the linear response over one range of each parameter, given all ranges of each."""
    whole = [_whole(own) for own in every]
    size = max(float(np.linalg.norm([np.linalg.norm(one.column) for one in whole])), _SILENT)
    return LinearResponse(
        parameters=tuple(chosen),
        columns=np.column_stack([one.column for one in chosen.values()]),
        sd=np.array([signature.effect.parameters[number].sd for number in chosen]),
        low=np.array([one.low for one in chosen.values()]),
        high=np.array([one.high for one in chosen.values()]),
        bounds=np.array([[own[0].low for own in every], [own[-1].high for own in every]]),
        size=size,
        before_refit=float(np.linalg.norm([one.before_refit for one in whole])) / size,
        parts=np.stack([one.parts for one in chosen.values()], axis=-1),
    )
