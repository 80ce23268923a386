"""The gap on held-out trials, before and after effects are added: nothing was fitted to these, and nothing chosen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from diagnosis.affected_swims import ForecastScore, forecast_scores, noise_floor_m
from diagnosis.controls import carried_over
from diagnosis.gap import SkillScore, skill_score
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, residual_drawn, residual_with
from diagnosis.result import Controls
from fitting.speed_line import speed_constant_stride, speed_line, speed_power_law
from fitting.trial import MeasuredTrial

_DRAWS = 400  # of coefficients and strengths as they might have been fitted
BASELINES = {"line": speed_line, "power_law": speed_power_law, "constant_stride": speed_constant_stride}


@dataclass(frozen=True, eq=False)
class Gap:
    """The held-out gap before and after.

    Attributes:
        shrinkage: in whitened squares.
        before, after: each held-out swim beside the plain twin and beside the one with effects; both run ahead alone.
        hertz: (t, 3) of each held-out trial: measured, and forecast from its command without and with effects, Hz; nan
            without a command.
        baselines: (t,) speeds by simple rules in frequency through the fitted trials, m/s, by the rule's name.
        noise_floor_m: mean distance that tracking noise alone would make.
        controls: what it would shrink by anyhow; None where nothing was added.
    """

    shrinkage: SkillScore
    before: tuple[ForecastScore, ...]
    after: tuple[ForecastScore, ...]
    hertz: np.ndarray
    baselines: Mapping[str, list[float]]
    noise_floor_m: float
    controls: Controls | None


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Swims that nothing was fitted to, beside the nearest plain twin.

    Attributes:
        linear: the fitted swims.
        swims: h of them.
        seed: of what is drawn.
    """

    linear: LinearModel
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
        linear, held_out, seed = self.linear, self.held_out, self.seed
        twins = [twin for twin in (best, placebo) if twin is not None]
        residual = [held_out.residual, *(residual_with(held_out, twin) for twin in twins)]
        stands = _stands([row[: len(held_out.model.measured)] for row in residual], len(self.swims))
        if not stands.all():
            standing = tuple(swim for swim, stood in zip(self.swims, stands, strict=True) if stood)
            return HeldOut(linear, standing, seed).gap(best, placebo, as_fitted=as_fitted)
        after, scored = self._plain, None
        controls, otherwise = None, None
        if best is not None:
            after = tuple(forecast_scores(linear, self.swims, best.effects, best.at, best.values))
            scored = held_out.whitened_swims(residual[1])
            controls = self._controls(placebo, residual[-1])
            if not as_fitted:
                drawn = (
                    held_out.residual_drawn(linear, _DRAWS, seed),
                    residual_drawn(held_out, best, residual[1], _DRAWS, seed),
                )
                otherwise = held_out.whitened_swims(drawn[0]), held_out.whitened_swims(drawn[1])
        skill = skill_score(self._scored, scored, self._trial_of, seed, otherwise)
        hertz = np.stack(
            [self._measured_hz, *(self._forecast_hz(row) for row in (residual[0], residual[best is not None]))], 1
        )
        return Gap(skill, self._plain, after, hertz, self._baselines, self._noise_floor_m, controls)

    def _controls(self, placebo: Refit | None, residual: np.ndarray) -> Controls:
        """What the gap would shrink by anyhow, with a placebo that leaves a residual (k,)."""

        def alone(row: np.ndarray) -> float | None:
            return skill_score(self._scored, self.held_out.whitened_swims(row), self._trial_of, self.seed).value

        return Controls(
            placebo=None if placebo is None else placebo.effects[0].name,
            with_placebo=None if placebo is None else alone(residual),
            carried_over=alone(carried_over(self.linear, self.held_out)),
        )

    @cached_property
    def _scored(self) -> np.ndarray:
        """(q,) whitened residual of the plain twin."""
        return self.held_out.whitened_swims(self.held_out.residual)

    @property
    def _trial_of(self) -> np.ndarray:
        return self.held_out.trial_of[self.held_out.scored]

    @property
    def _measured_hz(self) -> np.ndarray:
        return np.array([trial.frequency.hz for trial in self.swims])

    def _forecast_hz(self, residual: np.ndarray) -> np.ndarray:
        """(t,) that the commands lead to with a twin that leaves a residual (k,); nan without a command."""
        features = len(self.held_out.model.measured)
        commanded = np.array([trial.commanded_hz is not None for trial in self.swims])
        return np.where(commanded, self._measured_hz - residual[features : features + len(self.swims)], np.nan)

    @property
    def _baselines(self) -> Mapping[str, list[float]]:
        fitted, asked = self.linear.swims, [trial.start_frequency.hz for trial in self.swims]
        hz, speed = [trial.frequency.hz for trial in fitted], [trial.speed for trial in fitted]
        return {name: baseline(hz, speed, asked) for name, baseline in BASELINES.items()}

    @cached_property
    def held_out(self) -> LinearModel:
        """The swims beside the plain twin."""
        return self.linear.held_out(self.swims)

    @cached_property
    def _plain(self) -> tuple[ForecastScore, ...]:
        return tuple(forecast_scores(self.linear, self.swims, (), self.linear.at, np.zeros(0)))

    @cached_property
    def _noise_floor_m(self) -> float:
        each = [noise_floor_m(self.held_out, number, self.seed) for number in range(len(self.swims))]
        return float(np.nanmean(each))


def _stands(residual: Sequence[np.ndarray], trials: int) -> np.ndarray:
    """(t,) whether no twin diverged on a trial, of what each leaves (k,) of the features."""
    features = np.array([np.reshape(row, (trials, -1)) for row in residual])
    return np.asarray(np.isfinite(features).all(axis=(0, 2)))
