"""Effects as columns of a whitened row: what each parameter does, coefficients refitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from fitting.signatures import Signature, Whitened


@dataclass(frozen=True, eq=False)
class Form:
    """One way in which an effect may show, linear in its parameters.

    Attributes:
        parameters: which of the effect's parameters, (p,) indices.
        columns: (q, p) of the whitened row, for one standard deviation of each parameter's prior.
        sd: (p,) of the prior.
        low, high: (p,) bounds, in standard deviations.
        raw: root mean square whitened length of what the prior makes of it before coefficients are refitted, over
            `size`: what is not quite as the form says is a share of this.
    """

    parameters: tuple[int, ...]
    columns: np.ndarray
    sd: np.ndarray
    low: np.ndarray
    high: np.ndarray
    raw: float

    def nearest(self, target: np.ndarray, columns: np.ndarray | None = None) -> np.ndarray:
        """(p,) strengths within bounds, in standard deviations, that come nearest to a whitened row (q,).

        Args:
            target: the row.
            columns: (q, p) of this form in the row's directions; default: its own.
        """
        return np.asarray(lsq_linear(self.columns if columns is None else columns, target, (self.low, self.high)).x)

    @property
    def size(self) -> float:
        """Root mean square length of what the prior makes of it."""
        return float(np.sqrt((self.columns**2).sum()))


@dataclass(frozen=True, eq=False)
class Shown:
    """An effect with all its forms.

    Attributes:
        name: of the effect.
        stage: where it acts.
        forms: for an effect of one parameter, one for each strength that was tried; for one of more, all parameters
            with the slopes of weak ones, with those of strong ones, and each parameter alone.
    """

    name: str
    stage: str
    forms: tuple[Form, ...]


def shown(signatures: Sequence[Signature], space: Whitened) -> tuple[Shown, ...]:
    """Of signatures, in their order; what diverged or does nothing is left out."""
    return tuple(
        Shown(signature.effect.name, signature.effect.stage, tuple(_forms(signature, space)))
        for signature in signatures
    )


def _forms(signature: Signature, space: Whitened) -> list[Form]:
    """Slopes from each strength that was tried."""
    values, told = signature.values, np.nan_to_num(signature.rows)
    rows, raw = space.freed(told), np.linalg.norm(solve_triangular(space.root, told.T, lower=True), axis=0)
    finite = np.isfinite(signature.rows).all(axis=1)
    of = np.abs(values).argmax(axis=1)
    slopes: dict[int, list[_Slope]] = {}
    for row in np.argsort(np.abs(values).sum(axis=1)):
        if finite[row]:
            by = values[row, of[row]]
            slopes.setdefault(int(of[row]), []).append(_Slope(rows[row] / by, raw[row] / abs(by)))
    if not slopes:
        return []
    alone = [_form(signature, {number: slope}) for number, own in slopes.items() for slope in own]
    if values.shape[1] == 1:
        return _worth(alone)
    together = [_form(signature, {number: own[which] for number, own in slopes.items()}) for which in (0, -1)]
    single = [_form(signature, {number: own[which]}) for number, own in slopes.items() for which in (0, -1)]
    return _worth(together + single)


class _Slope(NamedTuple):
    """(q,) of the whitened row, coefficients refitted, and the length of what it was before."""

    column: np.ndarray
    raw: float


def _form(signature: Signature, slopes: Mapping[int, _Slope]) -> Form:
    own = [signature.effect.parameters[number] for number in slopes]
    sd = np.array([parameter.sd for parameter in own])
    columns = np.column_stack([slope.column for slope in slopes.values()]) * sd
    raw = float(
        np.sqrt(sum((parameter.sd * slope.raw) ** 2 for parameter, slope in zip(own, slopes.values(), strict=True)))
    )
    size = float(np.linalg.norm(columns))
    return Form(
        tuple(slopes),
        columns,
        sd,
        np.array([parameter.low for parameter in own]) / sd,
        np.array([parameter.high for parameter in own]) / sd,
        raw / max(size, 1e-300),
    )


def _worth(forms: list[Form]) -> list[Form]:
    return [form for form in forms if form.size > 1e-6]
