"""The gap on swims that nothing was fitted to, before and after effects are added."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from diagnosis.affected_swims import Swum, noise_floor_m, swum
from diagnosis.controls import carried_over
from diagnosis.gap import Shrinkage, shrinkage
from diagnosis.ground import Ground
from diagnosis.refit import Refit, left_drawn, left_with
from diagnosis.result import Controls
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


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Swims that nothing was fitted to, beside the nearest plain twin.

    Attributes:
        ground: the fitted swims.
        swims: h of them.
        seed: of what is drawn.
    """

    ground: Ground
    swims: tuple[MeasuredTrial, ...]
    seed: int

    def gap(self, best: Refit | None, placebo: Refit | None = None, *, as_fitted: bool = False) -> Gap | None:
        """Of the swims that no twin diverges on; None where there is none.

        Args:
            best: the twin with effects; None where none was added.
            placebo: the twin with an effect that is not there; None where there is none.
            as_fitted: the interval is over noise alone, of these very twins, and not over what else they might be.
        """
        if not self.swims:
            return None
        ground, beside, seed = self.ground, self._beside, self.seed
        twins = [twin for twin in (best, placebo) if twin is not None]
        left = [beside.left, *(left_with(beside, twin) for twin in twins)]
        stands = _stands([row[: len(beside.model.measured)] for row in left], len(self.swims))
        if not stands.all():
            standing = tuple(swim for swim, stood in zip(self.swims, stands, strict=True) if stood)
            return HeldOut(ground, standing, seed).gap(best, placebo, as_fitted=as_fitted)
        if best is None:
            return Gap(shrinkage(beside, None), self._plain, self._plain, self._noise_floor_m, None)
        after = tuple(swum(ground, self.swims, best.effects, best.at, best.values))
        otherwise = None
        if not as_fitted:
            otherwise = beside.left_drawn(ground, _DRAWS, seed), left_drawn(beside, best, left[1], _DRAWS, seed)
        controls = Controls(
            placebo=None if placebo is None else placebo.effects[0].name,
            with_placebo=None if placebo is None else shrinkage(beside, left[2]).value,
            carried_over=shrinkage(beside, carried_over(ground, beside)).value,
        )
        told = shrinkage(beside, left[1], seed, otherwise)
        return Gap(told, self._plain, after, self._noise_floor_m, controls)

    @cached_property
    def _beside(self) -> Ground:
        return self.ground.held_out(self.swims)

    @cached_property
    def _plain(self) -> tuple[Swum, ...]:
        return tuple(swum(self.ground, self.swims, (), self.ground.at, np.zeros(0)))

    @cached_property
    def _noise_floor_m(self) -> float:
        each = [noise_floor_m(self._beside, number, self.seed) for number in range(len(self.swims))]
        return float(np.nanmean(each))


def _stands(left: Sequence[np.ndarray], trials: int) -> np.ndarray:
    """(t,) whether no twin diverged on a trial, of what each leaves (k,) of the gaits."""
    gaits = np.array([np.reshape(row, (trials, -1)) for row in left])
    return np.asarray(np.isfinite(gaits).all(axis=(0, 2)))
