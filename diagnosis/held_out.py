"""Held-out swims without and with effects: the gap before and after, and how surely it shrinks.

Nothing was fitted to these swims, and nothing chosen by them. `forecast_scores` lets a twin run ahead on its own and
takes its errors; `HeldOut.gap` compares the plain twin with the one with effects.

`skill_score`: S = 1 - (L_with - F) / (L_plain - F), with L the mean squared whitened residual and F what noise alone
would leave, tells how far the gap shrinks. Its interval is that of the S which the true coefficients and strengths
would have on these swims without noise. Noise is taken off as a normal draw, whose size is known no better than it
shows where nothing is wrong: the twin's own error counts as noise here, and is not the same in every session. And
coefficients and strengths that were fitted are moved as far as they may be off. Whatever moves them makes a held-out
gap larger, more often than not, and the truth made it smaller: so their draws are reflected about what was found
(Davison and Hinkley 1997, section 5.2).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from diagnosis.constants import CLEAR, FLOOR_SD, LEAST_GAP
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, residual_drawn, residual_with
from diagnosis.result import GapSize, HeldOutSwim
from fitting.affected_trials import view_of
from fitting.baselines import BASELINES
from fitting.phase import fit_phase, forecast, score
from fitting.pool import forward_speed
from fitting.trial import MeasuredTrial
from fitting.trial_model import TrialModel
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.effect import Effect, View
from swimcal.mjcf import FluidCoefficients
from swimcal.runs import Runs, Trajectories

_SWIMS_DRAWN = 8  # swims with drawn noise behind a noise floor
_NOISE_DRAWS = 4000  # draws of trials and of noise behind an interval
_DRAWS = 400  # draws of coefficients and strengths as they might have been fitted
_PER_M = 1000.0  # mm in a metre


class ForecastScore(NamedTuple):
    """Scores of one trial against a twin that runs ahead on its own.

    Attributes:
        name: name of the trial.
        marker_error_m: marker error of the public contract, m.
        launch_free_error_m: the same of `Scores`.
        speed_measured, speed_twin: forward speeds, m/s.
    """

    name: str
    marker_error_m: float
    launch_free_error_m: float
    speed_measured: float
    speed_twin: float


class SettledTwin(AffectedTwin):
    """A twin with effects at given values, seen by the camera of one trial: it simulates what tracks would show.

    Args:
        twin: the twin with the effects.
        values: (p,) values of the effects, in the session's frame.
        view: the camera of the trial.
    """

    def __init__(self, twin: AffectedTwin, values: np.ndarray, view: View) -> None:
        super().__init__(twin.plain, twin.effects)
        self._settled, self._view = np.asarray(values, float), view

    def simulate(self, runs: Runs, time_s: np.ndarray, *, allow_divergence: bool = False) -> Trajectories:
        """Simulate what tracks would show: with the effects, and scaled by nose and neck."""
        values = np.tile(self.in_trial(self._view, self._settled), (len(runs), 1))
        own = AffectedRuns(**vars(runs), values=values)
        simulated = super().simulate(own, time_s, allow_divergence=allow_divergence)
        return replace(simulated, marker_m=self.tracked(own, simulated, self._view))


def forecast_scores(
    linear: LinearModel, trials: Sequence[MeasuredTrial], effects: Sequence[Effect], at: np.ndarray, values: np.ndarray
) -> list[ForecastScore]:
    """Score a twin with effects against trials; frequency and phase are those of each trial.

    Args:
        linear: the linearised model, with twin and camera.
        trials: the trials to score.
        effects: the effects.
        at: (5,) coefficients.
        values: (p,) values of the effects.
    """
    found, coefficients = [], FluidCoefficients(*map(float, at))
    for trial in trials:
        plain = TrialModel.of(linear.twin, trial).positions(linear.at[None])[0]
        view = view_of(trial, plain, linear.camera)
        twin = SettledTwin(AffectedTwin(linear.twin, effects), values, view) if effects else linear.twin
        head = forecast(twin, trial, coefficients, fit_phase(twin, trial, coefficients))
        speed = float(forward_speed(trial.time_s, head, trial.kept, trial.frequency.hz))
        scores = score(trial, head)
        errors_m = scores.marker_error_m, scores.launch_free_error_m
        found.append(ForecastScore(trial.name, *errors_m, trial.speed, speed))
    return found


# How far the gap shrinks.


@dataclass(frozen=True)
class SkillScore:
    """Skill score on one held-out gap.

    Attributes:
        plain, with_effects: mean squared whitened residual.
        value: S; None where the plain twin leaves no more than noise, or nothing was added.
        interval: 95 %, over trials, over their noise and its size, and over the errors of fitted numbers; None where S
            is, or where twins slightly off the fit diverge. It holds S itself, and apart from it nothing above 1: the
            residual may be less than F makes it. A single trial says nothing about others.
    """

    plain: float
    with_effects: float
    value: float | None
    interval: tuple[float, float] | None


def skill_score(
    before: np.ndarray,
    after: np.ndarray | None,
    trial_of: np.ndarray,
    seed: int = 0,
    otherwise: tuple[np.ndarray, np.ndarray] | None = None,
) -> SkillScore:
    """Compute the skill score from whitened residuals (q,) of some trials.

    Args:
        before: (q,) of the plain twin.
        after: (q,) of the one with effects; None where no effect was added.
        trial_of: (q,) number of the trial that each residual belongs to.
        seed: seed of the draws.
        otherwise: (d, q) each, residuals of draws of the plain twin and of the one with effects, fitted as they might
            have been; by default the fits are taken to be exact.
    """
    count = len(before)
    plain = float(before @ before / count)
    if after is None:
        return SkillScore(plain, plain, None, None)
    over, under = before @ before - count, after @ after - count
    with_effects = float(after @ after / count)
    if over < CLEAR * np.sqrt(2 * count + 4 * max(over, 0.0)):
        return SkillScore(plain, with_effects, None, None)
    drawn_over, drawn_under = (
        excess - noise for excess, noise in zip((over, under), _noise(before, after, seed), strict=True)
    )
    value = float(1 - under / over)
    drawn = 1 - np.maximum(drawn_under, 0.0) / np.maximum(drawn_over, LEAST_GAP * over)
    if trial_of.max() > 0:
        drawn += value - _over_trials(before, after, trial_of, seed)
    if otherwise is not None:
        values = _values(*otherwise)
        if not len(values):
            return SkillScore(plain, with_effects, value, None)
        drawn = np.add.outer(value - values, drawn).ravel()
    low, high = np.quantile(np.minimum(drawn, 1.0), [0.025, 0.975])  # without noise nothing shrinks by more than all
    return SkillScore(plain, with_effects, value, (min(float(low), value), max(float(high), value)))


def _over_trials(before: np.ndarray, after: np.ndarray, trial_of: np.ndarray, seed: int) -> np.ndarray:
    """Return S (d,) of several trials drawn anew (Bayesian bootstrap; Rubin 1981)."""
    over, under = (np.bincount(trial_of, row**2 - 1) for row in (before, after))  # (t,)
    shares = np.random.default_rng([seed, 29]).dirichlet(np.ones(len(over)), _NOISE_DRAWS)
    return np.asarray(1 - (shares @ under) / np.maximum(shares @ over, LEAST_GAP * over.mean()))


def _values(plain: np.ndarray, with_effects: np.ndarray) -> np.ndarray:
    """Return S of each draw (d, q) that did not diverge; there may be none."""
    standing = np.isfinite(plain).all(axis=1) & np.isfinite(with_effects).all(axis=1)
    over, under = ((rows[standing] ** 2).sum(axis=1) - rows.shape[1] for rows in (plain, with_effects))
    return np.asarray(1 - under / np.maximum(over, 1e-9))


def _noise(before: np.ndarray, after: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw what noise adds to the squares of two residuals (k,) of the same trials, beyond k; (d,) each.

    It is, for each residual, twice the noise along the noise-free residual, and the square of the noise.
    """
    count, random = len(before), np.random.default_rng([seed, 11])
    squares = np.maximum([before @ before - count, after @ after - count], 0.0)
    most = float(np.sqrt(squares.prod()))
    between = float(np.clip(before @ after - count, -most, most))
    along = random.multivariate_normal(np.zeros(2), [[squares[0], between], [between, squares[1]]], _NOISE_DRAWS)
    size = np.exp(FLOOR_SD * random.standard_normal(_NOISE_DRAWS) / 2)
    own = size**2 * random.chisquare(count, _NOISE_DRAWS) - count
    return 2 * size * along[:, 0] + own, 2 * size * along[:, 1] + own


# The gap of a session.


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Swims that nothing was fitted to, with the plain twin's forecast of them."""

    linear: LinearModel
    swims: tuple[MeasuredTrial, ...]
    seed: int

    def gap(self, best: Refit | None, *, as_fitted: bool = False) -> GapSize:
        """Compare the twins on the swims that none of them diverges on; without such swims nothing is compared.

        Args:
            best: the twin with effects; None where none was added.
            as_fitted: whether the interval is over noise alone, of these very twins, and not over what else they might
                be.
        """
        if not self.swims:
            return GapSize()
        linear, held_out, seed = self.linear, self.held_out, self.seed
        residual = [held_out.residual]
        if best is not None:
            residual.append(residual_with(held_out, best))
        features = [row[: len(held_out.model.measured)].reshape(len(self.swims), -1) for row in residual]
        stands = np.asarray(np.isfinite(features).all(axis=(0, 2)))  # (t,)
        if not stands.all():
            standing = tuple(swim for swim, stood in zip(self.swims, stands, strict=True) if stood)
            return HeldOut(linear, standing, seed).gap(best, as_fitted=as_fitted)
        plain, trial_of = held_out.whitened_swims(residual[0]), held_out.trial_of[held_out.scored]
        after, skill, without = self._plain, skill_score(plain, None, trial_of), None
        if best is not None:
            after = tuple(forecast_scores(linear, self.swims, best.effects, best.at, best.values))
            scored, drawn = held_out.whitened_swims(residual[1]), None
            if not as_fitted:
                drawn = (
                    held_out.whitened_swims(held_out.residual_drawn(linear, _DRAWS, seed)),
                    held_out.whitened_swims(residual_drawn(held_out, best, residual[1], _DRAWS, seed)),
                )
            skill = skill_score(plain, scored, trial_of, seed, drawn)
            other_way = None if drawn is None else (drawn[1], drawn[0])
            without = skill_score(scored, plain, trial_of, seed, other_way).interval
        hertz = [self._measured_hz, *(self._forecast_hz(row) for row in (residual[0], residual[-1]))]
        measured, baselines = [each.speed_measured for each in after], self._baselines
        swims = zip(self._plain, after, baselines["line"], *hertz, strict=True)
        return errors_of(
            self._plain,
            after,
            noise_floor_mm=_PER_M * self._noise_floor_m,
            shrinkage=np.nan if skill.value is None else skill.value,
            shrinkage_ci95=skill.interval,
            grows=without is not None and without[0] > 0,
            squares_before=skill.plain,
            squares_after=skill.with_effects,
            speed_mae_baselines={name: _mae(speeds, measured) for name, speeds in baselines.items()},
            frequency_mae_before=_mae(hertz[1], hertz[0]),
            frequency_mae_after=_mae(hertz[2], hertz[0]),
            trials={each[0].name: _swim(*each) for each in swims},
        )

    @property
    def _measured_hz(self) -> np.ndarray:
        return np.array([trial.frequency.hz for trial in self.swims])

    def _forecast_hz(self, residual: np.ndarray) -> np.ndarray:
        """Return the frequencies (t,) that the commands lead to with a twin, from its residual (k,).

        They are nan without a command.
        """
        features = len(self.held_out.model.measured)
        commanded = np.array([trial.commanded_hz is not None for trial in self.swims])
        return np.where(commanded, self._measured_hz - residual[features : features + len(self.swims)], np.nan)

    @property
    def _baselines(self) -> Mapping[str, list[float]]:
        """Speeds (t,) by simple rules in frequency through the fitted trials, m/s, by the rule's name."""
        fitted, asked = self.linear.swims, [trial.start_frequency.hz for trial in self.swims]
        hz, speed = [trial.frequency.hz for trial in fitted], [trial.speed for trial in fitted]
        return {name: baseline.rule(hz, speed, asked) for name, baseline in BASELINES.items()}

    @cached_property
    def held_out(self) -> LinearModel:
        """Linearised model of the held-out swims at the plain twin."""
        return self.linear.other_trials(self.swims, self.linear.twin)

    @cached_property
    def _plain(self) -> tuple[ForecastScore, ...]:
        return tuple(forecast_scores(self.linear, self.swims, (), self.linear.at, np.zeros(0)))

    @cached_property
    def _noise_floor_m(self) -> float:
        """Mean marker distance that tracking noise alone makes, as in the public contract, m.

        A swim of the twin is scored against itself with noise like that of the trial on it, several times.
        """
        linear, means = self.held_out, []
        for number, model in enumerate(linear.model.trials):
            trial, random, found = model.trial, np.random.default_rng([self.seed, 17, number]), []
            clean_m = linear.twin.simulate(model.runs(linear.at[None]), trial.time_s).marker_m[0]
            for _ in range(_SWIMS_DRAWN):
                noisy_m = clean_m + model.noise.drawn(trial.time_s, random)
                clean, noisy = (trial.seen_head(each) for each in (clean_m, noisy_m))
                found.append(score(trial.seen_as(head=noisy), clean).marker_error_m)
            means.append(float(np.mean(found)))
        return float(np.nanmean(means))


def errors_of(before: Sequence[ForecastScore], after: Sequence[ForecastScore], **more: object) -> GapSize:
    """Return the mean errors over the same swims without and with effects.

    Args:
        before: scores of the twin without effects.
        after: scores of the twin with effects.
        more: further fields of the result.
    """
    return GapSize(
        baseline_mm=_PER_M * float(np.nanmean([each.marker_error_m for each in before])),
        with_effects_mm=_PER_M * float(np.nanmean([each.marker_error_m for each in after])),
        speed_mae_before=_mae([each.speed_twin for each in before], [each.speed_measured for each in before]),
        speed_mae_after=_mae([each.speed_twin for each in after], [each.speed_measured for each in after]),
        evaluated_on=tuple(each.name for each in before),
        **more,  # type: ignore[arg-type]
    )


def _swim(
    before: ForecastScore, after: ForecastScore, line: float, measured_hz: float, before_hz: float, after_hz: float
) -> HeldOutSwim:
    return HeldOutSwim(
        before_mm=_PER_M * before.marker_error_m,
        after_mm=_PER_M * after.marker_error_m,
        speed_measured=before.speed_measured,
        speed_before=before.speed_twin,
        speed_after=after.speed_twin,
        speed_line=line,
        frequency_measured_hz=float(measured_hz),
        frequency_before_hz=float(before_hz),
        frequency_after_hz=float(after_hz),
    )


def _mae(forecast: Sequence[float] | np.ndarray, measured: Sequence[float] | np.ndarray) -> float:
    """Return the mean absolute error of the forecasts that are known; nan if there are none."""
    errors = np.abs(np.subtract(forecast, measured))
    return float(errors[np.isfinite(errors)].mean()) if np.isfinite(errors).any() else float("nan")
