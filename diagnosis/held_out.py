"""The gap on swims that nothing was fitted to, before and after effects are added."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.affected_swims import Swum, noise_floor_m, swum
from diagnosis.controls import Controls, carried_over
from diagnosis.gap import Shrinkage, shrinkage
from diagnosis.ground import Ground
from diagnosis.refit import Refit, left_drawn, left_with
from fitting.trial import MeasuredTrial

_DRAWS = 400  # of coefficients and strengths as they might have been fitted


@dataclass(frozen=True, eq=False)
class Gap:
    """The held-out gap before and after.

    Attributes:
        shrinkage: in whitened squares.
        before, after: each held-out swim beside the plain twin and beside the one with effects; both run ahead alone.
        noise_floor_m: mean distance that tracking noise alone would make.
        controls: what it would shrink by anyhow; None where nothing was added.
    """

    shrinkage: Shrinkage
    before: tuple[Swum, ...]
    after: tuple[Swum, ...]
    noise_floor_m: float
    controls: Controls | None


def held_out_gap(
    ground: Ground, held: Sequence[MeasuredTrial], best: Refit | None, placebo: Refit | None, seed: int
) -> Gap | None:
    """Of the held-out swims that no twin diverges on; None where there is none.

    Args:
        ground: the fitted swims.
        held: the held-out ones.
        best: the twin with effects; None where none was added.
        placebo: the twin with an effect that is not there; None where there is none.
        seed: of what is drawn.
    """
    beside = ground.held_out(held)
    twins = [twin for twin in (best, placebo) if twin is not None]
    left = [beside.left, *(left_with(beside, twin) for twin in twins)]
    stands = _stands([row[: len(beside.model.measured)] for row in left], len(held))
    standing = [trial for trial, stood in zip(held, stands, strict=True) if stood]
    if len(standing) < len(held):
        return held_out_gap(ground, standing, best, placebo, seed) if standing else None
    before = tuple(swum(ground, held, (), ground.at, np.zeros(0)))
    floor = float(np.nanmean([noise_floor_m(beside, number, seed) for number in range(len(held))]))
    if best is None:
        return Gap(shrinkage(beside, None), before, before, floor, None)
    after = tuple(swum(ground, held, best.effects, best.at, best.values))
    otherwise = beside.left_drawn(ground, _DRAWS, seed), left_drawn(beside, best, left[1], _DRAWS, seed)
    controls = Controls(
        placebo=None if placebo is None else placebo.effects[0].name,
        with_placebo=None if placebo is None else shrinkage(beside, left[2]).value,
        carried_over=shrinkage(beside, carried_over(ground, beside)).value,
    )
    return Gap(shrinkage(beside, left[1], seed, otherwise), before, after, floor, controls)


def _stands(left: Sequence[np.ndarray], trials: int) -> np.ndarray:
    """(t,) whether no twin diverged on a trial, of what each leaves (k,) of the gaits."""
    gaits = np.array([np.reshape(row, (trials, -1)) for row in left])
    return np.asarray(np.isfinite(gaits).all(axis=(0, 2)))
