"""The gap on swims that nothing was fitted to, before and after effects are added."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.affected_swims import Swum, noise_floor_m, swum
from diagnosis.controls import Controls, carried_over
from diagnosis.gap import Shrinkage, shrinkage
from diagnosis.ground import Ground
from diagnosis.refit import Refit, left_with
from fitting.trial import MeasuredTrial

_DRAWS = 32  # of coefficients and strengths as they might have been fitted


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
    standing = _standing(ground, held, [twin for twin in (best, placebo) if twin is not None])
    if not standing:
        return None
    beside = ground.held_out(standing)
    before = tuple(swum(ground, standing, (), ground.at, np.zeros(0)))
    floor = float(np.nanmean([noise_floor_m(beside, number, seed) for number in range(len(standing))]))
    if best is None:
        return Gap(shrinkage(beside, None), before, before, floor, None)
    after = tuple(swum(ground, standing, best.effects, best.at, best.values))
    left, drawn = left_with(beside, best, _DRAWS, seed)
    otherwise = beside.left_at(ground.coefficients_drawn(_DRAWS, seed)), drawn
    return Gap(shrinkage(beside, left, seed, otherwise), before, after, floor, _controls(ground, beside, placebo))


def _standing(ground: Ground, held: Sequence[MeasuredTrial], twins: Sequence[Refit]) -> list[MeasuredTrial]:
    beside = ground.held_out(held)
    rows = [beside.left, *(left_with(beside, twin)[0] for twin in twins)]
    gaits = np.array([np.reshape(row[: -len(held)], (len(held), -1)) for row in rows])
    return [trial for trial, stands in zip(held, np.isfinite(gaits).all(axis=(0, 2)), strict=True) if stands]


def _controls(ground: Ground, beside: Ground, placebo: Refit | None) -> Controls:
    without_physics = shrinkage(beside, carried_over(ground, beside)).value
    if placebo is None:
        return Controls(None, None, without_physics)
    left, _ = left_with(beside, placebo)
    return Controls(placebo.effects[0].name, shrinkage(beside, left).value, without_physics)
