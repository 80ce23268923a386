"""`results/evidence.json`: what stands beside a fit, in millimetres at the edge, and back."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fitting.evidence import Evidence, YawFit
from fitting.pairs import PairFit
from fitting.placed_fit import PlacedFit, PlacedTrial
from fitting.placement import BoxesOff
from fitting.profile import CoefficientProfiles
from swimmer import FluidCoefficients

MILLIMETRES = 1000.0


def evidence_payload(evidence: Evidence) -> dict[str, Any]:
    """Everything of `evidence.json` but its provenance."""
    yaw, profiles = evidence.yaw, evidence.profiles
    return {
        "yaw": {
            "coefficients": yaw.coefficients._asdict(),
            "mean_distance_mm": yaw.mean_distance_m * MILLIMETRES,
            "yaw_rad": dict(yaw.yaw_rad),
            "converged": yaw.converged,
        },
        "placed": _placed_payload(evidence.placed),
        "profiles": {
            "value": profiles.value.tolist(),
            "slice_mm": (profiles.slice_m * MILLIMETRES).tolist(),
            "profile_mm": (profiles.profile_m * MILLIMETRES).tolist(),
            "best_mm": profiles.best_m * MILLIMETRES,
            "restart": profiles.restart.tolist(),
            "restart_mm": (profiles.restart_m * MILLIMETRES).tolist(),
        },
        "pairs": [
            {
                "fitted": list(pair.fitted),
                "coefficients": pair.coefficients._asdict(),
                "marker_error_mm": pair.marker_error_m * MILLIMETRES,
                "speed_mae": pair.speed_mae,
                "swims_forward": pair.swims_forward,
                "converged": pair.converged,
            }
            for pair in evidence.pairs
        ],
    }


def read_evidence(data: Mapping[str, Any]) -> Evidence:
    """Reads what `evidence_payload` gave."""
    yaw, profiles = data["yaw"], data["profiles"]
    return Evidence(
        yaw=YawFit(
            FluidCoefficients(**yaw["coefficients"]),
            yaw["mean_distance_mm"] / MILLIMETRES,
            dict(yaw["yaw_rad"]),
            yaw["converged"],
        ),
        placed=_read_placed(data["placed"]),
        profiles=CoefficientProfiles(
            value=np.array(profiles["value"]),
            slice_m=np.array(profiles["slice_mm"]) / MILLIMETRES,
            profile_m=np.array(profiles["profile_mm"]) / MILLIMETRES,
            best_m=profiles["best_mm"] / MILLIMETRES,
            restart=np.array(profiles["restart"], float).reshape(-1, 5),
            restart_m=np.array(profiles["restart_mm"], float) / MILLIMETRES,
        ),
        pairs=tuple(
            PairFit(
                fitted=(pair["fitted"][0], pair["fitted"][1]),
                coefficients=FluidCoefficients(**pair["coefficients"]),
                marker_error_m=pair["marker_error_mm"] / MILLIMETRES,
                speed_mae=dict(pair["speed_mae"]),
                swims_forward=pair["swims_forward"],
                converged=pair["converged"],
            )
            for pair in data["pairs"]
        ),
    )


def _placed_payload(placed: PlacedFit) -> dict[str, Any]:
    return {
        "coefficients": placed.coefficients._asdict(),
        "mean_distance_mm": placed.mean_distance_m * MILLIMETRES,
        "converged": placed.converged,
        "flags": [flag.message for flag in placed.flags],
        "markers": {
            name: {"off_mm": _told(off * MILLIMETRES), "sd_mm": _told(sd * MILLIMETRES)}
            for name, off, sd in zip(placed.markers, placed.marker_m, placed.marker_sd_m, strict=True)
        },
        "trials": {
            trial.name: {
                "boxes_mm": _told(np.array(trial.boxes) * MILLIMETRES),
                "boxes_sd_mm": _told(np.array(trial.boxes_sd) * MILLIMETRES),
                "turn_rad": _told([trial.boxes.turn_rad])[0],
                "scale": _told([trial.boxes.scale])[0],
                "distance_mm": _told([trial.distance_m * MILLIMETRES])[0],
                "shape_mm": _told([trial.shape_m * MILLIMETRES])[0],
            }
            for trial in placed.trials
        },
    }


def _read_placed(data: Mapping[str, Any]) -> PlacedFit:
    markers = data["markers"]
    return PlacedFit(
        FluidCoefficients(**data["coefficients"]),
        data["mean_distance_mm"] / MILLIMETRES,
        data["converged"],
        tuple(markers),
        _metres([each["off_mm"] for each in markers.values()]),
        _metres([each["sd_mm"] for each in markers.values()]),
        tuple(
            PlacedTrial(
                name,
                BoxesOff(*map(float, _metres(told["boxes_mm"]))),
                BoxesOff(*map(float, _metres(told["boxes_sd_mm"]))),
                float(_metres(told["distance_mm"])),
                float(_metres(told["shape_mm"])),
            )
            for name, told in data["trials"].items()
        ),
    )


def _told(values: Sequence[float] | np.ndarray) -> list[float | None]:
    """None where a number is not known."""
    return [float(value) if np.isfinite(value) else None for value in values]


def _metres(values: Any) -> np.ndarray:
    """From millimetres; nan where a number is not known."""
    return np.array(values, float) / MILLIMETRES
