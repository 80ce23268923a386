"""Diagnoses made by hand, one for each verdict."""

from typing import Any

import numpy as np

from diagnosis.result import DiagnosisResult, MissingForces
from swimcal.results import from_plain, to_plain
from swimcal.robot import load_robot
from tests.reports.sample import MARKERS

JOINTS = ("head_along", "head_across", "head_moment", *load_robot().hinges)
FITTED = ("medium", "fast")
_COEFFICIENTS = {"blunt_drag": 0.7, "slender_drag": 3.0, "angular_drag": 5.0, "kutta_lift": 4.0, "magnus_lift": 1.0}
_GROUPS: dict[str, list[list[str]]] = {
    "named": [["tendon_slack"], ["wave_drag"]],
    "inseparable": [["tendon_slack", "tendon_friction"]],
    "unexplained": [],
    "no_gap": [],
}


def made_diagnosed(verdict: str = "named", *, held_out: bool = True, **changes: Any) -> DiagnosisResult:
    """A diagnosis, with changes in the plain form of its file: those of evidence, gap and where by their keys."""
    plain = _plain_data(verdict, held_out)
    for part in {"evidence", "gap", "where"} & changes.keys():
        changes[part] = plain[part] | changes[part]
    made: DiagnosisResult = from_plain(DiagnosisResult, plain | changes)
    return made


def _plain_data(verdict: str, held_out: bool) -> dict[str, Any]:
    groups = _GROUPS[verdict]
    first = [group[0] for group in groups]
    alone = {"speed": 0.04, "frequency": 0.0}
    spread = (0.96 - 0.6) / (len(MARKERS) - 1)
    markers = dict.fromkeys(MARKERS, spread) | {"caudal_fin": 0.6}
    nothing = verdict == "no_gap"
    stages = {"camera": -0.02, "drive": 0.1, "body": 0.22, "tail": 0.6, "floor": 0.1}
    return {
        "verdict": verdict,
        "groups": groups,
        "effects": [name for group in groups for name in group],
        "probabilities": {"tendon_slack": 0.93, "wave_drag": 0.91, "tendon_friction": 0.31, "none_of_these": 0.02},
        "no_gap_probability": 0.99 if nothing else 0.0,
        "remainder": {"share": 0.12, "stage": "tail", "p_value": 0.0004} if groups else None,
        "where": {
            "by_stage": {"camera": 0.0, "drive": 0.01, "body": 0.02, "tail": 0.0, "floor": 0.97} if nothing else stages,
            "by_trial": {"medium": 0.3, "fast": 0.7},
            "by_marker": markers | alone,
            "by_axis": {"along": 0.16, "across": 0.8} | alone,
            "by_band": {"mean": 0.03, "drift": 0.03, "harmonic_1": 0.5, "harmonic_2": 0.1, "harmonic_3": 0.3} | alone,
        },
        "everything": None,
        "coefficients": {"plain": _COEFFICIENTS},
        "stage_alone": {"camera": 0.05, "drive": 0.3, "body": 0.4, "tail": 0.75},
        "gap": _gap(bool(groups)) if held_out else {"shrinkage": None, "shrinkage_ci95": None, "evaluated_on": []},
        "effect_parameters": {name: _PARAMETERS[name] for name in first},
        "next_experiments": [
            {"describe": "Run it dry.", "separates": ["tendon_slack", "tendon_friction"], "expected_error": 0.04}
        ]
        if verdict == "inseparable"
        else [],
        "missing_forces": to_plain(made_forces()),
        "free_decays": [
            {
                "trial": "let go",
                "stiffness_over_mass": -0.0214,
                "stiffness_over_mass_se": 0.0088,
                "damping_over_mass": 0.104,
                "damping_over_mass_se": 0.011,
                "not_used": None,
            },
            {"trial": "let go again", "not_used": "the head moves"},
        ],
        "frequencies": {
            "medium": {"commanded_hz": 1.0, "measured_hz": 0.99},
            "fast": {"commanded_hz": 1.5, "measured_hz": 1.5},
        },
        "evidence": _evidence(),
        "withheld_from_catalogue": [],
    }


def _evidence() -> dict[str, Any]:
    return {
        "squares": 512.0,
        "numbers": 256,
        "sets": [
            _set(0.7, "tendon_slack", "wave_drag"),
            _set(0.1, "wave_drag", other=True),
            _set(0.02, other=True),
            _set(0.001),
        ],
        "elsewhere": [
            {"place": "marker tail_4", "same_in_all_trials": True, "probability": 0.07},
            {"place": "hinge tail_1", "same_in_all_trials": True, "probability": 0.06},
        ],
        "refuted": [],
    }


def made_everything() -> dict[str, Any]:
    """The twin with all effects at once, as a `diagnosis.json` has it."""
    return {
        "share_of_priors": 0.7,
        "log_evidence_gained": 41.2,
        "coefficients": _COEFFICIENTS,
        "at_bound": [["crank_arm_error", "relative"]],
        "strengths": [
            {"effect": "crank_arm_error", "parameter": "relative", "strength_sd": -3.2},
            {"effect": "tendon_asymmetry", "parameter": "length", "strength_sd": 1.4},
        ],
        "gap": _gap(True) | {"shrinkage": 0.3, "shrinkage_ci95": [0.1, 0.6]},
    }


_PARAMETERS: dict[str, Any] = {
    "tendon_slack": {"value": 0.0021, "ci95": [0.0018, 0.0024], "unit": "m", "at_bound": False, "parameter": "length"},
    "wave_drag": {
        "low": {"value": 0.4, "ci95": [0.1, 0.7], "unit": "1", "at_bound": False, "parameter": "low"},
        "high": {"value": -1.5, "ci95": [-2.0, -1.0], "unit": "s", "at_bound": True, "parameter": "high"},
    },
}


def _gap(named: bool) -> dict[str, Any]:
    """Of one swim, whose gap shrinks to a fifth where something is named."""
    after = (3.0, 0.052, 1.8) if named else (12.0, 0.061, 5.0)
    return {
        "baseline_mm": 12.0,
        "with_effects_mm": after[0],
        "noise_floor_mm": 0.6,
        "shrinkage": 0.8 if named else None,
        "shrinkage_ci95": [0.7, 0.9] if named else None,
        "speed_mae_before": 0.011,
        "speed_mae_after": after[1] - 0.05,
        "evaluated_on": ["slow"],
        "squares_before": 5.0,
        "squares_after": after[2],
        "trials": {
            "slow": {
                "before_mm": 12.0,
                "after_mm": after[0],
                "speed_measured": 0.05,
                "speed_before": 0.061,
                "speed_after": after[1],
            }
        },
    }


def made_forces(size: float = 0.004, sd: float = 0.0003) -> MissingForces:
    """Nothing is missing but a torque in the last hinge, N m."""
    mean = np.zeros((len(FITTED), len(JOINTS), 7))
    mean[:, -1, 1] = size
    return MissingForces(JOINTS, FITTED, mean, np.full_like(mean, sd))


def _set(probability: float, *effects: str, other: bool = False) -> dict[str, Any]:
    """An explanation with its probability."""
    return {"effects": list(effects), "something_else": other, "probability": probability}
