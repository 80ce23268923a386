"""Effects as columns of a whitened row: what each parameter does, coefficients refitted."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from fitting.signatures import Signature, Whitened
from fitting.signatures.slopes import pieces

_SAME = 0.1  # relative difference up to which two slopes count as one
_SILENT = 1e-6  # whitened length of one standard deviation below which an effect does nothing


@dataclass(frozen=True, eq=False)
class Form:
    """How an effect shows over one stretch of its strengths, linear in its parameters.

    Attributes:
        parameters: which of the effect's parameters, (p,) indices.
        columns: (q, p) of the whitened row, for one standard deviation of each parameter's prior.
        sd: (p,) of the prior.
        low, high: (p,) ends of the stretch, in standard deviations.
        bounds: (2, p) ends of what the parameters may be at all.
        size: root mean square length of what the prior makes of the effect, of one for all its stretches.
        raw: the same before coefficients are refitted, over `size`: what is not quite as the form says is a share of
            this.
    """

    parameters: tuple[int, ...]
    columns: np.ndarray
    sd: np.ndarray
    low: np.ndarray
    high: np.ndarray
    bounds: np.ndarray
    size: float
    raw: float

    def nearest(self, target: np.ndarray, columns: np.ndarray | None = None) -> np.ndarray:
        """(p,) strengths within bounds, in standard deviations, that come nearest to a whitened row (q,).

        Args:
            target: the row.
            columns: (q, p) of this form in the row's directions; default: its own.
        """
        return np.asarray(lsq_linear(self.columns if columns is None else columns, target, tuple(self.bounds)).x)


@dataclass(frozen=True, eq=False)
class Shown:
    """An effect with all its forms.

    Attributes:
        name: of the effect.
        stage: where it acts.
        ways: alternatives, each with forms that share out the strengths that there may be: all parameters together,
            and, for an effect of several, each alone.
    """

    name: str
    stage: str
    ways: tuple[tuple[Form, ...], ...]

    @property
    def forms(self) -> tuple[Form, ...]:
        """Of all ways."""
        return tuple(form for way in self.ways for form in way)

    @cached_property
    def slopes(self) -> np.ndarray:
        """(q, s) whatever one parameter by itself does, of one standard deviation."""
        alone = self.ways[1:] or self.ways
        return np.hstack([form.columns for way in alone for form in way])


def shown(signatures: Sequence[Signature], space: Whitened) -> tuple[Shown, ...]:
    """Of signatures, in their order; of what diverged or does nothing there are no forms.

    Args:
        signatures: of the catalogue.
        space: that whitens.
    """
    return tuple(
        Shown(signature.effect.name, signature.effect.stage, _ways(signature, space)) for signature in signatures
    )


class _Stretch(NamedTuple):
    """Of one parameter, in standard deviations.

    Its ends, the (q,) column, and its length before coefficients are refitted.
    """

    low: float
    high: float
    column: np.ndarray
    raw: float


def _ways(signature: Signature, space: Whitened) -> tuple[tuple[Form, ...], ...]:
    stretches = {number: _stretches(signature, number, space) for number in range(signature.values.shape[1])}
    stretches = {number: own for number, own in stretches.items() if own}
    alone = [tuple(_form(signature, {number: one}, [own]) for one in own) for number, own in stretches.items()]
    if len(alone) <= 1:
        return tuple(alone)
    every = list(stretches.values())
    if len(every) == 2:
        chosen = [dict(zip(stretches, both, strict=True)) for both in product(*every)]
    else:  # too many to tell them all apart; such effects are nearly linear
        chosen = [{number: _whole(own) for number, own in stretches.items()}]
    return (tuple(_form(signature, one, every) for one in chosen), *alone)


def _stretches(signature: Signature, number: int, space: Whitened) -> list[_Stretch]:
    """Neighbours that do the same are one."""
    sd, all_pieces = signature.effect.parameters[number].sd, pieces(signature, number)
    if not all_pieces:
        return []
    rows = sd * np.array([piece.slope for piece in all_pieces])
    columns, raws = space.freed(rows), np.linalg.norm(solve_triangular(space.root, rows.T, lower=True), axis=0)
    found: list[_Stretch] = []
    for piece, column, raw in zip(all_pieces, columns, raws, strict=True):
        last = found[-1] if found else None
        if last is not None and np.linalg.norm(column - last.column) <= _SAME * np.linalg.norm(last.column):
            found[-1] = last._replace(high=piece.high / sd)
        else:
            found.append(_Stretch(piece.low / sd, piece.high / sd, column, float(raw)))
    return found if any(np.linalg.norm(each.column) > _SILENT for each in found) else []


def _whole(stretches: Sequence[_Stretch]) -> _Stretch:
    """All strengths as those that are least."""
    least = min(stretches, key=lambda each: max(each.low, -each.high))
    return least._replace(low=stretches[0].low, high=stretches[-1].high)


def _form(signature: Signature, chosen: dict[int, _Stretch], every: Sequence[Sequence[_Stretch]]) -> Form:
    """Of one stretch of each parameter, out of all stretches of each."""
    sd = np.array([signature.effect.parameters[number].sd for number in chosen])
    size, raw = (
        float(np.sqrt(sum(length(_whole(own)) ** 2 for own in every)))
        for length in (lambda one: float(np.linalg.norm(one.column)), lambda one: one.raw)
    )
    return Form(
        tuple(chosen),
        np.column_stack([one.column for one in chosen.values()]),
        sd,
        np.array([one.low for one in chosen.values()]),
        np.array([one.high for one in chosen.values()]),
        np.array([[own[0].low for own in every], [own[-1].high for own in every]]),
        max(size, _SILENT),
        raw / max(size, _SILENT),
    )
