"""The dry run: crank arm, speed and phase from a robot whose head is clamped in air while its motor turns."""

from fitting.dry_run.crank import CrankFit, CrankTrial
from fitting.dry_run.crank_fit import crank_response, fit_crank
from fitting.dry_run.error_surface import (
    Cell,
    CrankGrid,
    ErrorSurface,
    error_surface,
    published_distance,
    speed_range,
)
from fitting.dry_run.joint import JointFit, JointTrial, fit_joint
from fitting.dry_run.measured import DryTrial, measure_dry_run
from fitting.dry_run.published import other_valley, refine_valleys
from fitting.dry_run.response import DryResponse, Turn, simulate_response, simulate_turns, with_arm
from fitting.dry_run.tendons import PUBLISHED_STRETCH, TendonUse, tendon_use

__all__ = [
    "PUBLISHED_GRID",
    "PUBLISHED_STRETCH",
    "Cell",
    "CrankFit",
    "CrankGrid",
    "CrankTrial",
    "DryResponse",
    "DryTrial",
    "ErrorSurface",
    "JointFit",
    "JointTrial",
    "TendonUse",
    "Turn",
    "crank_response",
    "error_surface",
    "fit_crank",
    "fit_joint",
    "measure_dry_run",
    "other_valley",
    "published_distance",
    "refine_valleys",
    "simulate_response",
    "simulate_turns",
    "speed_range",
    "tendon_use",
    "with_arm",
]
