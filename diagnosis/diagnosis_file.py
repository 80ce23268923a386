"""Conversion of a diagnosis, and of a test of effects, to the records that result files hold (`diagnosis.result`).

`beside_exported_twin` then counts the gap from the twin that a user exports.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.constants import FEWEST_TRIALS
from diagnosis.diagnose import Diagnosis, WeighedEffects
from diagnosis.refit import Refit, RidgeFit
from diagnosis.result import (
    NONE,
    AllEffects,
    BeatFrequency,
    CrossValidation,
    DiagnosisResult,
    EffectParameters,
    EffectSet,
    EffectTestResult,
    Evidence,
    FittedParameter,
    FreeDecay,
    GapSize,
    Place,
    Strength,
)
from diagnosis.unknown_effects import STAGE_OF
from diagnosis.verdict import borderline
from fitting.session_forecast import TWIN, SessionForecast
from swimcal.effects.effect import Parameter
from swimcal.mjcf import FluidCoefficients

_AT_BOUND = 0.01  # largest distance from a bound, as a share of the parameter's range
_LEAST = 1e-4  # least probability of an effect that is reported
_LEAST_OF_PLACE = 0.01  # least probability of a place that is reported
_SETS = 12  # sets of effects that are reported


def diagnosis_result(found: Diagnosis, withheld: Sequence[str] = (), models: Sequence[str] = ()) -> DiagnosisResult:
    """Return the record of a diagnosis.

    Args:
        found: the diagnosis.
        withheld: names of effects that the catalogue lacked.
        models: names of the files of twins with effects.
    """
    chances, verdict, best = found.said.probabilities, found.said.verdict, found.said.best
    present = {n: float(p) for n, p in zip(chances.names, chances.marginal, strict=True) if p >= _LEAST}
    refits = {"plain": found.weighed.linear.at} | ({} if best is None else {"with_effects": best.at})
    return DiagnosisResult(
        verdict=verdict.name,
        groups=verdict.groups,
        effects=verdict.effects,
        probabilities=dict(sorted(present.items(), key=lambda item: -item[1])) | {NONE: min(chances.other, 1.0)},
        remainder=found.remainder,
        where=found.where.shares,
        gap=found.gap,
        effect_parameters={} if best is None else _parameters(best),
        next_experiments=found.experiments,
        no_gap_probability=min(chances.null, 1.0),
        everything=None if found.everything is None else _everything(*found.everything),
        coefficients={name: FluidCoefficients(*map(float, at)) for name, at in refits.items()},
        stage_alone=found.where.alone,
        missing_forces=found.where.forces,
        free_decays=_decays(found),
        frequencies={t.name: BeatFrequency(t.commanded_hz, float(t.frequency.hz)) for t in found.weighed.linear.trials},
        evidence=_evidence(found),
        withheld_from_catalogue=tuple(withheld),
        doubted_trials=found.doubted,
        models=tuple(models),
        reference=found.weighed.reference,
        adequate=found.adequate,
        borderline=_borderline(found),
        stages=_stages(found),
    )


def _borderline(found: Diagnosis) -> str | None:
    """Name the verdict that this one nearly was."""
    other = found.said.near or borderline(found.said.verdict, found.said.probabilities)
    if other is None:
        return None
    named = ", ".join(" or ".join(group) for group in other.groups)
    return f"{other.name} ({named})" if named else other.name


def _stages(found: Diagnosis) -> dict[str, float]:
    """Return the stages of an unknown effect where no known ones suffice; else sum up the effects of each stage."""
    if found.unknown_at:
        return dict(found.unknown_at)
    chances, of_stage = found.said.probabilities, dict[str, list[int]]()
    for number, signature in enumerate(found.weighed.signatures):
        of_stage.setdefault(STAGE_OF.get(signature.effect.family, signature.effect.family), []).append(number)
    return {stage: min(float(chances.any_present(own)), 1.0) for stage, own in of_stage.items()}


def effect_test_result(found: WeighedEffects) -> EffectTestResult:
    """Return the record of a test of effects."""
    return EffectTestResult(
        effects=tuple(effect.name for effect in found.refit.effects),
        log_bayes_factor=found.log_bayes_factor,
        log_bayes_factor_of_each=found.of_each,
        effect_parameters=_parameters(found.refit),
        fitted=found.fitted,
        gap=found.gap,
    )


def beside_exported_twin(found: DiagnosisResult, forecasts: SessionForecast) -> DiagnosisResult:
    """Replace the errors of the plain twin, from which the diagnosis started, by those of the exported twin.

    The plain twin has the hinges as described and the exported one as calibrated, so their errors differ a little. A
    user exports and compares the second; the skill scores stay those of the first.

    Args:
        found: the record of `diagnosis_result`.
        forecasts: forecasts of the fit that the diagnosis rests on.
    """
    gap = _compare_with_exported(found.gap, forecasts, bool(found.effect_parameters))
    if found.everything is None:
        return replace(found, gap=gap)
    return replace(
        found,
        gap=gap,
        everything=replace(found.everything, gap=_compare_with_exported(found.everything.gap, forecasts, True)),
    )


def of_session(found: DiagnosisResult, reference: str) -> DiagnosisResult:
    """Note the folder of the reference session, relative to the diagnosed one's."""
    assert found.reference is not None, "a diagnosis without a reference"
    return replace(found, reference=replace(found.reference, session=reference))


def _compare_with_exported(gap: GapSize, forecasts: SessionForecast, added: bool) -> GapSize:
    """Return the gap from the exported twin to the one with effects, or to itself where none was `added`.

    The gap is unchanged where the forecasts lack one of its trials.
    """
    exported = {name: trial.forecasts.get(TWIN) for name, trial in forecasts.trials.items()}
    trials = {}
    for name, trial in (gap.trials or {}).items():
        own = exported.get(name)
        if own is None or own.marker_error_mm is None:
            return gap
        trials[name] = replace(trial, before_mm=own.marker_error_mm, speed_before=own.speed)
        if not added:
            trials[name] = replace(trials[name], after_mm=own.marker_error_mm, speed_after=own.speed)
    if not trials:
        return gap
    errors = np.array(
        [
            (t.before_mm, t.after_mm, abs(t.speed_before - t.speed_measured), abs(t.speed_after - t.speed_measured))
            for t in trials.values()
        ]
    )
    before_mm, after_mm, before, after = map(float, np.nanmean(errors, axis=0))
    return replace(
        gap,
        baseline_mm=before_mm,
        with_effects_mm=after_mm,
        speed_mae_before=before,
        speed_mae_after=after,
        trials=trials,
    )


def _everything(every: RidgeFit, gap: GapSize) -> AllEffects:
    strengths = sorted(every.strengths.items(), key=lambda item: -abs(item[1]))
    return AllEffects(
        share_of_priors=every.share,
        log_evidence_gained=every.gained,
        coefficients=FluidCoefficients(*map(float, every.refit.at)),
        at_bound=every.at_bound,
        strengths=tuple(Strength(*own, value) for own, value in strengths),
        gap=gap,
    )


def _decays(found: Diagnosis) -> tuple[FreeDecay, ...]:
    fits = []
    for ring in found.weighed.linear.model.rings:
        off, se = np.expm1(ring.residual), np.exp(ring.residual) * ring.sd
        fits.append(FreeDecay(ring.name, float(off[0]), float(se[0]), float(off[1]), float(se[1])))
    return (*fits, *(FreeDecay(name, not_used=why) for name, why in found.weighed.decays_left_out.items()))


def _parameters(best: Refit) -> EffectParameters:
    half = 1.96 * np.sqrt(np.diag(best.covariance))[5:]
    fitted_of: dict[str, dict[str, FittedParameter]] = {}
    for (effect, parameter, value), own in zip(best.parameters, half, strict=True):
        fitted_of.setdefault(effect, {})[parameter.name] = _parameter(parameter, value, float(own))
    return {effect: own if len(own) > 1 else next(iter(own.values())) for effect, own in fitted_of.items()}


def _parameter(parameter: Parameter, value: float, half: float) -> FittedParameter:
    interval = (max(value - half, parameter.low), min(value + half, parameter.high))
    near = _AT_BOUND * (parameter.high - parameter.low)
    at_bound = any(end and abs(value - end) < near for end in (parameter.low, parameter.high))
    return FittedParameter(value, interval, parameter.unit, bool(at_bound), parameter.name)


def _evidence(found: Diagnosis) -> Evidence:
    chances, residual = found.said.probabilities, found.weighed.hypotheses.like_any
    likeliest = sorted(chances.of.items(), key=lambda item: -item[1])[:_SETS]
    places = (
        Place(each.place, each.same, float(chance))
        for each, chance in zip(found.weighed.elsewhere, chances.at_place, strict=True)
        if chance >= _LEAST_OF_PLACE
    )
    return Evidence(
        squares=float(residual.value @ residual.value),
        numbers=len(residual.value),
        sets=tuple(
            EffectSet(tuple(chances.names[i] for i in each.present), each.other, chance) for each, chance in likeliest
        ),
        elsewhere=tuple(sorted(places, key=lambda each: -each.probability)),
        refuted=found.said.refutations,
        cross_validation=_cross_validation(found),
    )


def _cross_validation(found: Diagnosis) -> CrossValidation:
    names, skill = tuple(trial.name for trial in found.weighed.linear.swims), found.said.skill
    if len(names) < FEWEST_TRIALS:
        return CrossValidation(())
    if skill is None or skill.value is None:
        return CrossValidation(names)
    return CrossValidation(names, skill.value, skill.interval)
