"""The dry run: crank arm, speed and phase from a robot whose head is clamped in air while its motor turns."""

from fitting.dry_run.crank import CrankFit, CrankTrial, crank_response, fit_crank
from fitting.dry_run.measured import DryTrial, measure_dry_run
from fitting.dry_run.response import PUBLISHED_STRETCH

__all__ = [
    "PUBLISHED_STRETCH",
    "CrankFit",
    "CrankTrial",
    "DryTrial",
    "crank_response",
    "fit_crank",
    "measure_dry_run",
]
