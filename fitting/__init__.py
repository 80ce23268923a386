"""Estimation: swim frequency and phase, fluid coefficients, elongated body theory, and their scores."""

from fitting.calibration import CalibratedTrial, Calibration, calibrate
from fitting.calibration_file import CalibrationResult
from fitting.coefficient_fit import CoefficientFit
from fitting.structure import Structure
from fitting.trial import MeasuredTrial, measure_trial

__all__ = [
    "CalibratedTrial",
    "Calibration",
    "CalibrationResult",
    "CoefficientFit",
    "MeasuredTrial",
    "Structure",
    "calibrate",
    "measure_trial",
]
