"""Records of a diagnosis, as ``results/diagnosis.json`` and ``results/supposed.json`` hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fitting.pool import waves
from swimcal.mjcf import FluidCoefficients
from swimcal.results import ResultFile

NONE = "none_of_these"
# Beats are forecast worse if their error grows by both: tracks leave 0.2 mHz uncertain on the sample, 2 on real trials.
_WORSE = 1.1
_UNSURE_HZ = 0.005

VerdictName = Literal["named", "inseparable", "unexplained", "no_gap"]


@dataclass(frozen=True)
class Remainder:
    """The residual of the fit trials that the refitted twin with the named effects does not explain.

    Attributes:
        share: this residual as a share of that of the plain twin, both squared, whitened and above noise.
        stage: the stage with the largest part of it.
        p_value: probability that noise alone leaves as much.
    """

    share: float
    stage: str | None
    p_value: float


@dataclass(frozen=True)
class GapShares:
    """Shares of the squared whitened residual of the fitted plain twin; those of each split add up to 1.

    Attributes:
        by_stage: shares of camera, drive, body, tail and noise ("floor"); may be negative.
        by_trial: shares of the fit trials, by name.
        by_marker: shares of the markers, and of numbers that belong to no marker: speed, course, frequency, decay.
        by_axis: shares along and across the fish.
        by_band: shares of the mean and of each harmonic of the beat.
    """

    by_stage: Mapping[str, float]
    by_trial: Mapping[str, float]
    by_marker: Mapping[str, float]
    by_axis: Mapping[str, float]
    by_band: Mapping[str, float]


@dataclass(frozen=True)
class HeldOutSwim:
    """One held-out trial beside the twin without and with effects; distances in mm, speeds in m/s.

    Attributes:
        before_mm, after_mm: mean marker distance of the twin without effects, in a session's results the exported
            one, and of the twin with effects.
        speed_measured, speed_before, speed_after: forward speed of the robot, and of either twin.
        speed_line: speed by a straight line in frequency through the fit trials.
        frequency_measured_hz, frequency_before_hz, frequency_after_hz: beat frequency of the robot, and as either
            twin forecasts it from the command; nan without a command.
    """

    before_mm: float
    after_mm: float
    speed_measured: float
    speed_before: float
    speed_after: float
    speed_line: float = float("nan")
    frequency_measured_hz: float = float("nan")
    frequency_before_hz: float = float("nan")
    frequency_after_hz: float = float("nan")


@dataclass(frozen=True)
class GapSize:
    """Mean errors over swim trials of the twin without and with effects; nan where nothing can be compared.

    Attributes:
        baseline_mm, with_effects_mm: mean marker distance of the twin without effects, in a session's results the
            exported one, and of the twin with effects.
        speed_mae_before, speed_mae_after: mean absolute speed error of either twin, m/s.
        speed_mae_baselines: mean absolute speed error, m/s, of simple rules in frequency through the fit trials:
            "line", "power_law", "constant_stride".
        frequency_mae_before, frequency_mae_after: mean absolute error of the beat frequency that either twin forecasts
            from the command, Hz.
        evaluated_on: names of the trials.
        noise_floor_mm: mean marker distance that tracking noise alone makes.
        shrinkage, shrinkage_ci95: skill score S, the share of the squared whitened residual that the effects remove,
            with its 95 % interval, all of them from the plain twin, whose hinges are as described; null where that
            leaves no more than noise.
        grows: whether the effects surely make the gap larger: the plain twin has a skill over the one with them, whose
            95 % interval lies wholly above 0.
        squares_before, squares_after: mean squared whitened residual of the plain twin and of the one with effects.
        trials: every trial by its name.
    """

    baseline_mm: float = float("nan")
    with_effects_mm: float = float("nan")
    speed_mae_before: float = float("nan")
    speed_mae_after: float = float("nan")
    evaluated_on: tuple[str, ...] = ()
    noise_floor_mm: float = float("nan")
    shrinkage: float = float("nan")
    shrinkage_ci95: tuple[float, float] | None = None
    grows: bool = False
    squares_before: float = float("nan")
    squares_after: float = float("nan")
    speed_mae_baselines: Mapping[str, float] = field(default_factory=dict)
    frequency_mae_before: float = float("nan")
    frequency_mae_after: float = float("nan")
    trials: Mapping[str, HeldOutSwim] | None = None

    @property
    def improves(self) -> bool:
        """Return whether the effects surely improve forecasts of trials that nothing was fitted to."""
        return self.shrinkage_ci95 is not None and self.shrinkage_ci95[0] > 0

    @property
    def frequency_grows(self) -> bool:
        """Return whether beats are forecast worse with the effects, by more than tracks leave uncertain."""
        before = self.frequency_mae_before
        return self.frequency_mae_after > max(_WORSE * before, before + _UNSURE_HZ)


@dataclass(frozen=True)
class FittedParameter:
    """A fitted parameter of an effect.

    Attributes:
        value, ci95: the parameter with its 95 % interval.
        unit: SI unit of both; "1" for a ratio.
        at_bound: whether the value is at a bound of the parameter.
        parameter: name of the parameter.
    """

    value: float
    ci95: tuple[float, float]
    unit: str
    at_bound: bool
    parameter: str


EffectParameters = Mapping[str, FittedParameter | Mapping[str, FittedParameter]]
"""The fitted parameters by effect: its only parameter, or each under its name."""


def parameters_of(found: EffectParameters, effect: str) -> Mapping[str, FittedParameter]:
    """Return the parameters of an effect by their names; none for an effect that was not fitted."""
    own = found.get(effect, {})
    return {own.parameter: own} if isinstance(own, FittedParameter) else own


@dataclass(frozen=True)
class Strength:
    """A parameter of the joint fit of all effects.

    Attributes:
        effect, parameter: names.
        strength_sd: fitted value in standard deviations of its prior.
    """

    effect: str
    parameter: str
    strength_sd: float


@dataclass(frozen=True)
class AllEffects:
    """The joint fit: the twin with all effects of the catalogue, by ridge regression.

    Attributes:
        share_of_priors: factor on the width of every prior that the evidence of the fit trials chooses.
        log_evidence_gained: log Bayes factor over the twin with the named effects alone.
        coefficients: the five fluid coefficients of this twin.
        at_bound: effect and name of every parameter that is at a bound.
        strengths: every parameter in standard deviations of its prior, the largest first.
        gap: errors on held-out trials.
    """

    share_of_priors: float
    log_evidence_gained: float
    coefficients: FluidCoefficients
    at_bound: tuple[tuple[str, str], ...]
    strengths: tuple[Strength, ...]
    gap: GapSize


@dataclass(frozen=True)
class ProposedTrial:
    """A trial that could be added to a session.

    Attributes:
        kind: "swim", "dry" or "free_decay".
        commanded_hz: crank turns a second to command; null for a free decay.
        logged: whether the motor is to be logged.
    """

    kind: Literal["swim", "dry", "free_decay"]
    commanded_hz: float | None = None
    logged: bool = False


@dataclass(frozen=True)
class Experiment:
    """An experiment that would separate two effects.

    Attributes:
        describe: what to do, in a sentence.
        separates: names of the two effects.
        expected_error: probability that one is still taken for the other afterwards; 0.5 is a coin toss.
        trial: the trial to add; null where something else is to be done, such as a clock in view.
    """

    describe: str
    separates: tuple[str, str]
    expected_error: float
    trial: ProposedTrial | None = None


@dataclass(frozen=True, eq=False)
class MissingForces:
    """Forces on the head and torques in the hinges that would remove the residual, as functions of the crank angle.

    Attributes:
        joints: (j,) names: along and across the head, the moment on it, then the hinges.
        trials: (t,) names of the fit trials.
        mean, sd: (t, j, 7) estimate and standard deviation of the mean, then of cosine and sine of each harmonic of
            the crank angle, N or N m.
    """

    joints: tuple[str, ...]
    trials: tuple[str, ...]
    mean: np.ndarray
    sd: np.ndarray

    def over(self, turn_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (t, j, n) at crank angles (n,); coefficients are taken as independent."""
        columns = np.column_stack([np.ones(len(turn_rad)), waves(turn_rad, self.mean.shape[-1] // 2)])
        return self.mean @ columns.T, np.sqrt(self.sd**2 @ columns.T**2)

    @property
    def size(self) -> np.ndarray:
        """Root mean square over the beat and the swims, (j,), N or N m."""
        squares = self.mean[..., 0] ** 2 + (self.mean[..., 1:] ** 2).sum(axis=-1) / 2
        return np.asarray(np.sqrt(squares.mean(axis=0)))

    @property
    def clear(self) -> np.ndarray:
        """Share of the beats in which zero lies beyond two standard deviations, (j,)."""
        mean, sd = self.over(np.linspace(0.0, 2 * np.pi, 72, endpoint=False))
        return np.asarray((np.abs(mean) > 2 * sd).mean(axis=(0, 2)))


@dataclass(frozen=True)
class FreeDecay:
    """Numbers that a free decay determines, relative to the robot as described.

    Attributes:
        trial: name of the trial.
        stiffness_over_mass, damping_over_mass: relative differences; null where the decay is not used.
        stiffness_over_mass_se, damping_over_mass_se: standard errors of these, by tracking noise.
        not_used: why the decay is not used.
    """

    trial: str
    stiffness_over_mass: float | None = None
    stiffness_over_mass_se: float | None = None
    damping_over_mass: float | None = None
    damping_over_mass_se: float | None = None
    not_used: str | None = None


@dataclass(frozen=True)
class BeatFrequency:
    """Beat frequency of a fit trial.

    Attributes:
        commanded_hz: crank turns a second that were commanded; null where not known.
        measured_hz: frequency of the tail, from the film.
    """

    commanded_hz: float | None
    measured_hz: float


@dataclass(frozen=True)
class EffectSet:
    """Effects that may be present together.

    Attributes:
        effects: names; each stands for itself, or for an unknown effect that looks like it.
        something_else: whether the set has an unknown effect, too.
        probability: posterior probability of exactly this set.
    """

    effects: tuple[str, ...]
    something_else: bool
    probability: float


@dataclass(frozen=True)
class Place:
    """A place where something may act that is not in the catalogue (localised discrepancy).

    Attributes:
        place: name of the marker, hinge or part.
        same_in_all_trials: whether it acts alike in all trials.
        probability: posterior probability.
    """

    place: str
    same_in_all_trials: bool
    probability: float


@dataclass(frozen=True)
class WithdrawnEffects:
    """Effects that forecasts withdrew: with them, trials are forecast worse.

    Attributes:
        effects: names.
        shrinkage, shrinkage_ci95: skill score S of the cross-validation with its 95 % interval, wholly below 0; null
            where held-out trials withdrew them.
        held_out_mm: mean marker distance on held-out trials without and with them, where these withdrew them.
    """

    effects: tuple[str, ...]
    shrinkage: float = float("nan")
    shrinkage_ci95: tuple[float, float] | None = None
    held_out_mm: tuple[float, float] | None = None


@dataclass(frozen=True)
class CrossValidation:
    """Cross-validation of the named effects: each fit trial forecast by twins that are fitted to the others.

    Attributes:
        trials: names of the trials that were left out in turn; none where fewer than three were fitted.
        shrinkage, shrinkage_ci95: skill score S with its 95 % interval; null where nothing is named.
    """

    trials: tuple[str, ...]
    shrinkage: float = float("nan")
    shrinkage_ci95: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence that a diagnosis rests on.

    Attributes:
        squares, numbers: squared whitened residual of the fitted plain twin, and how many numbers it is the sum of.
        sets: sets of effects with their probabilities, the likeliest first.
        elsewhere: places where an unknown effect may act, the likeliest first.
        refuted: effects that cross-validation or held-out trials withdrew.
        cross_validation: cross-validation of the named effects.
    """

    squares: float
    numbers: int
    sets: tuple[EffectSet, ...]
    elsewhere: tuple[Place, ...]
    refuted: tuple[WithdrawnEffects, ...]
    cross_validation: CrossValidation = CrossValidation(())


@dataclass(frozen=True)
class Visible:
    """The least change of one parameter that a comparison would show.

    Attributes:
        parameter: name of the parameter.
        value: change at which the swims lie `CLEAR_CHANGE` standard deviations apart, all else the same.
        unit: SI unit; "1" for a ratio.
        within_bounds: whether the parameter can be that large at all.
    """

    parameter: str
    value: float
    unit: str
    within_bounds: bool


@dataclass(frozen=True)
class ComparedWith:
    """The reference session of a diagnosis: the same robot, camera and water before something changed.

    Attributes:
        session: its folder, relative to the diagnosed session's.
        swims: names of its fitted swims.
        launch_scatter: how much launches differ, against the usual, as the reference shows.
        speeds: commanded or filmed frequency, Hz, and forward speed, m/s, of its swims, by name.
        visible: the least change that would show, by effect.
    """

    session: str
    swims: tuple[str, ...]
    launch_scatter: float
    speeds: Mapping[str, tuple[float, float]]
    visible: Mapping[str, Visible]


@dataclass(frozen=True)
class Adequacy:
    """Test of whether the best set of effects leaves no more than noise.

    Attributes:
        p_value: probability that noise, with an error of the effects' form, leaves as much.
        squares, numbers: squared whitened residual that it leaves, and how many numbers it is the sum of.
    """

    p_value: float
    squares: float
    numbers: int


@dataclass(frozen=True, eq=False)
class DiagnosisResult:
    """The content of ``diagnosis.json``; the public contract's keys come first.

    Attributes:
        verdict: "named", "inseparable", "unexplained" or "no_gap".
        groups: lists of alternatives that the data cannot separate, the likeliest first; all lists act together.
        effects: names in `groups`, each once.
        probabilities: probability that each effect is present, the likeliest first, and of `none_of_these`.
        remainder: residual that the named effects do not explain; null where nothing is named.
        where: shares of the residual, split in several ways.
        gap: errors on held-out trials without and with the named effects.
        effect_parameters: fitted parameters of the likeliest effect of each group.
        next_experiments: experiments that separate effects, the most informative first.
        no_gap_probability: probability that there is no gap.
        everything: the joint fit of all effects; null where the evidence does not ask for it.
        coefficients: the five fluid coefficients of the twin "plain" and "with_effects".
        stage_alone: share that each stage would explain if it were the only one.
        missing_forces: forces and torques that would remove the residual.
        free_decays: what each free decay determines.
        frequencies: commanded and measured beat frequency of every fit trial.
        evidence: what the verdict rests on.
        withheld_from_catalogue: names of effects that the catalogue lacked in this run.
        doubted_trials: fitted swims that their own twin does not follow, with the found effects neither; because of
            these no effect is named.
        models: names of the files of twins with effects.
        reference: the session that this one was compared with; null without one.
        adequate: whether the best set of effects leaves no more than noise.
        borderline: the other verdict that it nearly was, with its effects in brackets; null where it is clear.
        stages: probability that an unmodelled effect acts on the camera, drive, tendons, structure or water: one of the
            catalogue or, where no set of these leaves only noise, any.
    """

    verdict: VerdictName
    groups: tuple[tuple[str, ...], ...]
    effects: tuple[str, ...]
    probabilities: Mapping[str, float]
    remainder: Remainder | None
    where: GapShares
    gap: GapSize
    effect_parameters: EffectParameters
    next_experiments: tuple[Experiment, ...]
    no_gap_probability: float
    everything: AllEffects | None
    coefficients: Mapping[str, FluidCoefficients]
    stage_alone: Mapping[str, float]
    missing_forces: MissingForces
    free_decays: tuple[FreeDecay, ...]
    frequencies: Mapping[str, BeatFrequency]
    evidence: Evidence
    withheld_from_catalogue: tuple[str, ...] = ()
    doubted_trials: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    reference: ComparedWith | None = None
    adequate: Adequacy | None = None
    borderline: str | None = None
    stages: Mapping[str, float] = field(default_factory=dict)

    @property
    def chances(self) -> dict[str, float]:
        """Probabilities of the effects alone."""
        return {name: chance for name, chance in self.probabilities.items() if name != NONE}

    @property
    def none_of_these(self) -> float:
        """Probability of something that the catalogue does not hold."""
        return self.probabilities[NONE]


@dataclass(frozen=True)
class EffectTestResult:
    """The content of ``supposed.json``: the test of effects that a user names.

    Attributes:
        effects: names of the tested effects.
        log_bayes_factor: log Bayes factor of all tested effects together over the plain twin.
        log_bayes_factor_of_each: log Bayes factor of each effect over the twin with all the others.
        effect_parameters: fitted parameters of the tested effects.
        fitted, gap: errors on the fit trials and on held-out trials, without and with the effects.
    """

    effects: tuple[str, ...]
    log_bayes_factor: float
    log_bayes_factor_of_each: Mapping[str, float]
    effect_parameters: EffectParameters
    fitted: GapSize
    gap: GapSize


DIAGNOSIS = ResultFile("diagnosis.json", DiagnosisResult)
EFFECT_TEST = ResultFile("supposed.json", EffectTestResult)
