"""A diagnosis as `diagnosis.json` has it."""

from typing import Any

import numpy as np

from diagnosis.affected_swims import Swum
from diagnosis.diagnosis import Diagnosis
from diagnosis.everything import Everything
from diagnosis.held_out import Gap
from diagnosis.refit import Refit
from diagnosis.supposition import Supposition
from fitting.posterior.gait import places_of_slides
from swimmer import FluidCoefficients

NONE = "none_of_these"
_AT_BOUND = 0.01  # share of what a parameter may be, from a bound
_LEAST, _LEAST_OF_PLACE = 1e-4, 0.01  # probability that is told, of an effect and of a place


def diagnosis_payload(found: Diagnosis) -> dict[str, Any]:
    """By the public contract; what stands beside it (`evidence`) is for the report."""
    chances = found.probabilities
    told = {n: float(p) for n, p in zip(chances.names, chances.marginal, strict=True) if p >= _LEAST}
    where, verdict, rest = found.where, found.verdict, found.remainder
    return {
        "verdict": verdict.name,
        "groups": [list(group) for group in verdict.groups],
        "effects": list(verdict.effects),
        "probabilities": dict(sorted(told.items(), key=lambda item: -item[1])) | {NONE: min(chances.other, 1.0)},
        "no_gap_probability": min(chances.null, 1.0),
        "remainder": None if rest is None else {"share": rest.share, "stage": rest.stage, "p_value": rest.p_value},
        "where": {
            "by_stage": dict(where.by_stage),
            "by_trial": dict(where.by_trial),
            "by_marker": dict(where.by_marker),
            "by_axis": dict(where.by_axis),
            "by_band": dict(where.by_band),
        },
        "gap": _gap(found.gap),
        "everything": None if found.everything is None else _everything(*found.everything),
        "effect_parameters": {} if found.refit is None else _parameters(found.refit),
        "next_experiments": [
            {
                "describe": e.describe,
                "separates": list(e.separates),
                "expected_error": e.expected_error,
                "trial": None if e.trial is None else e.trial._asdict(),
            }
            for e in found.experiments
        ],
        "coefficients": {"plain": _named_coefficients(found.ground.at)}
        | ({} if found.refit is None else {"with_effects": _named_coefficients(found.refit.at)}),
        "stage_alone": dict(where.alone),
        "missing_forces": _forces(found),
        "free_decays": _decays(found),
        "frequencies": {
            trial.name: {"commanded_hz": trial.commanded_hz, "measured_hz": float(trial.frequency.hz)}
            for trial in found.ground.trials
        },
        "evidence": _evidence(found),
    }


def supposition_payload(found: Supposition) -> dict[str, Any]:
    """As `supposed.json` has it."""
    plain, supposed = found.fitted
    return {
        "effects": [effect.name for effect in found.refit.effects],
        "log_bayes_factor": found.log_bayes_factor,
        "log_bayes_factor_of_each": dict(found.of_each),
        "effect_parameters": _parameters(found.refit),
        "fitted": _beside(plain, supposed),
        "gap": _gap(found.gap),
    }


def _everything(every: Everything, gap: Gap | None) -> dict[str, Any]:
    """The twin with all effects at once, the strongest first; strengths in standard deviations of their priors."""
    strengths = sorted(every.strengths.items(), key=lambda item: -abs(item[1]))
    return {
        "share_of_priors": every.share,
        "log_evidence_gained": every.gained,
        "coefficients": _named_coefficients(every.refit.at),
        "at_bound": [list(each) for each in every.at_bound],
        "strengths": [{"effect": own[0], "parameter": own[1], "strength_sd": told} for own, told in strengths],
        "gap": _gap(gap),
    }


def _decays(found: Diagnosis) -> list[dict[str, Any]]:
    """Of each, relative to the robot as described, with standard errors by tracking noise; or why it does not count."""
    told = [
        {
            "trial": ring.name,
            "stiffness_over_mass": float(np.expm1(ring.left[0])),
            "stiffness_over_mass_se": float(np.exp(ring.left[0]) * ring.sd[0]),
            "damping_over_mass": float(np.expm1(ring.left[1])),
            "damping_over_mass_se": float(np.exp(ring.left[1]) * ring.sd[1]),
            "not_used": None,
        }
        for ring in found.ground.model.rings
    ]
    return [*told, *({"trial": name, "not_used": why} for name, why in found.decays_left_out.items())]


def _gap(gap: Gap | None) -> dict[str, Any]:
    if gap is None:
        keys = ("baseline_mm", "with_effects_mm", "baseline_placed_mm", "with_effects_placed_mm", "noise_floor_mm")
        others = ("shrinkage", "shrinkage_ci95", "speed_mae_before", "speed_mae_after")
        return dict.fromkeys((*keys, *others)) | {"evaluated_on": []}
    told = gap.shrinkage
    return _beside(gap.before, gap.after) | {
        "noise_floor_mm": 1000 * gap.noise_floor_m,
        "shrinkage": told.value,
        "shrinkage_ci95": None if told.interval is None else list(told.interval),
        "squares_before": told.plain,
        "squares_after": told.with_effects,
        "controls": None if gap.controls is None else gap.controls._asdict(),
        "trials": {
            b.name: {
                "before_mm": 1000 * b.marker_error_m,
                "after_mm": 1000 * a.marker_error_m,
                "before_placed_mm": 1000 * b.placed_error_m,
                "after_placed_mm": 1000 * a.placed_error_m,
                "speed_measured": b.speed_measured,
                "speed_before": b.speed_twin,
                "speed_after": a.speed_twin,
            }
            for b, a in zip(gap.before, gap.after, strict=True)
        },
    }


def _beside(before: tuple[Swum, ...], after: tuple[Swum, ...]) -> dict[str, Any]:
    """Means over the same swims without and with effects."""
    return {
        "baseline_mm": _millimetres([each.marker_error_m for each in before]),
        "with_effects_mm": _millimetres([each.marker_error_m for each in after]),
        "baseline_placed_mm": _millimetres([each.placed_error_m for each in before]),
        "with_effects_placed_mm": _millimetres([each.placed_error_m for each in after]),
        "speed_mae_before": _speed_error(before),
        "speed_mae_after": _speed_error(after),
        "evaluated_on": [each.name for each in before],
    }


def _millimetres(metres: list[float]) -> float:
    """Their mean."""
    return 1000 * float(np.nanmean(metres))


def _speed_error(swims: tuple[Swum, ...]) -> float:
    return float(np.mean([abs(each.speed_twin - each.speed_measured) for each in swims]))


def _parameters(best: Refit) -> dict[str, Any]:
    """By effect; one with several parameters has each under its name."""
    sd = np.sqrt(np.diag(best.covariance))[5:]
    told: dict[str, Any] = {}
    number = 0
    for effect in best.effects:
        own = {}
        for parameter in effect.parameters:
            value, half = float(best.values[number]), 1.96 * float(sd[number])
            bounds = [max(value - half, parameter.low), min(value + half, parameter.high)]
            near = _AT_BOUND * (parameter.high - parameter.low)
            at_bound = any(end and abs(value - end) < near for end in (parameter.low, parameter.high))
            own[parameter.name] = {"value": value, "ci95": bounds, "unit": parameter.unit, "at_bound": at_bound}
            number += 1
        told[effect.name] = next(iter(own.values())) | {"parameter": next(iter(own))} if len(own) == 1 else own
    return told


def _named_coefficients(at: np.ndarray) -> dict[str, float]:
    return FluidCoefficients(*map(float, at))._asdict()


def _forces(found: Diagnosis) -> dict[str, Any]:
    forces, swims = found.where.forces, found.ground.swims  # of which nothing acts on the head in a dry run
    return {
        "joints": list(forces.joints),
        "trials": [trial.name for trial in swims],
        "mean": forces.mean[: len(swims)].tolist(),
        "sd": forces.sd[: len(swims)].tolist(),
    }


def _evidence(found: Diagnosis) -> dict[str, Any]:
    chances = found.probabilities
    likeliest = sorted(chances.of.items(), key=lambda item: -item[1])[:12]
    row = found.explanations.row
    return {
        "squares": row.squares,
        "numbers": len(row.left),
        "sets": [
            {
                "effects": [chances.names[i] for i in each.present],
                "something_else": each.other,
                "that_looks_like": None if each.like is None else chances.names[each.like],
                "probability": chance,
            }
            for each, chance in likeliest
        ],
        "elsewhere": _elsewhere(found),
        "refuted": _refuted(found),
        **_beside_the_beat(found),
        "sliding": _sliding(found),
    }


def _beside_the_beat(found: Diagnosis) -> dict[str, Any]:
    """What shows beside the beat: how far, how late, and how probably something else makes it."""
    kinds = zip(("sway", "delay"), ("rms_m", "rms_s"), found.beside, found.explanations.showing_beside, strict=True)
    return {
        name: {
            rms: told.rms,
            "log_bayes_factor": told.log_odds,
            "probability": min(found.probabilities.with_other * chance, 1.0),  # sums of exponentials round
        }
        for name, rms, told, chance in kinds
    }


def _sliding(found: Diagnosis) -> dict[str, Any]:
    """How fast markers slide forward along the fish, m/s, beside the plain twin and beside the one with effects."""
    model = found.ground.model
    count, whole = len(model.trials), len(model.measured)
    places = places_of_slides(whole // count)
    left = {"beside_plain": found.ground.left, "beside_effects": None if found.refit is None else found.refit.left}
    told = {
        name: None if row is None else row[:whole].reshape(count, -1)[:, places].tolist() for name, row in left.items()
    }
    markers = found.ground.trials[0].markers[: places.stop - places.start]
    return {"markers": list(markers), "trials": [trial.name for trial in found.ground.trials], **told}


def _refuted(found: Diagnosis) -> list[dict[str, Any]]:
    """Names that are not said, for held-out swims speak against them."""
    return [
        {"effects": [each.effect], "shrinkage": each.shrinkage, "shrinkage_ci95": list(each.interval)}
        for each in found.refutations
    ]


def _elsewhere(found: Diagnosis) -> list[dict[str, Any]]:
    """Places where there may be something else, the likeliest first."""
    told = [
        {
            "place": each.place,
            "goes_with": each.goes_with,
            "same_in_all_trials": each.same,
            "probability": chance,
        }
        for each, chance in zip(found.elsewhere, found.probabilities.at_place, strict=True)
        if chance >= _LEAST_OF_PLACE
    ]
    return sorted(told, key=lambda each: -float(each["probability"]))
