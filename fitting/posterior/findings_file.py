"""`results/posterior.json`: what is said of a posterior, and back; its draws stand in `posterior.nc`."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from fitting.left_out import EffectsLeftOut, LeftOut
from fitting.posterior.approximate import Approximate
from fitting.posterior.findings import Findings
from fitting.posterior.further_trial import FurtherTrials
from fitting.posterior.identifiability import Identifiability
from fitting.posterior.posterior import Marginal
from fitting.posterior.posterior_file import load_chains
from fitting.posterior.predictive import PredictedSweep, PredictedTrial
from fitting.posterior.shared import RobotPart
from fitting.posterior.whiteness import Whiteness
from session import Flag

T = TypeVar("T")


def findings_payload(findings: Findings) -> dict[str, Any]:
    """Everything of `posterior.json` but its provenance, in SI units; the sentence comes first."""
    plain = {key: _plain(value) for key, value in vars(findings).items() if key != "chains"}
    return {"sentence": findings.identifiability.sentence, **plain}


def read_findings(data: Mapping[str, Any], draws: Path) -> Findings:
    """Reads what `findings_payload` gave, with the draws of a `posterior.nc`."""
    kept = {field.name: _value(data[field.name]) for field in fields(Findings) if field.name in data}
    return Findings(
        **kept
        | {
            "marginals": {name: Marginal(**one) for name, one in data["marginals"].items()},
            "chains": load_chains(draws),
            "identifiability": _made(Identifiability, data["identifiability"]),
            "left_out": _left_out(data["left_out"]),
            "robot": tuple(RobotPart(**one) for one in data["robot"]),
            "further": _made(FurtherTrials, data["further"]),
            "sweep": _made(PredictedSweep, data["sweep"]),
            "trials": tuple(_made(PredictedTrial, one) for one in data["trials"]),
            "whiteness": tuple(_made(Whiteness, one) for one in data["whiteness"]),
            "laplace": _made(Approximate, data["laplace"]),
            "naive": _made(Approximate, data["naive"]),
            "flags": tuple(map(Flag.from_json, data["flags"])),
        }
    )


def _plain(value: Any) -> Any:
    """Nested results as mappings and lists; arrays and flags are left to the writer."""
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if hasattr(value, "_asdict"):
        return _plain(value._asdict())
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.ndarray | Flag) or not hasattr(value, "__dict__"):
        return value
    return _plain(vars(value))


def _left_out(data: Mapping[str, Any]) -> EffectsLeftOut:
    tried = tuple(_made(LeftOut, one) for one in data["tried"])
    return EffectsLeftOut(tried, data["seen_from"], tuple(data["silent"]), tuple(data["diverged"]))


def _made(kind: type[T], data: Mapping[str, Any]) -> T:
    return kind(**{key: _value(value) for key, value in data.items()})


def _value(value: Any) -> Any:
    """Lists of numbers as arrays, null as nan."""
    if value is None:
        return float("nan")
    if isinstance(value, list) and not any(isinstance(one, dict | str) for one in value):
        whole = np.array(value)
        return whole if whole.dtype == bool else np.array(value, float)
    return value
