"""What estimates numbers: swim frequency and phase, fluid coefficients, elongated body theory, and their scores."""

from fitting.calibration import CalibratedTrial, Calibration, Summary, assemble, calibrate
from fitting.calibration_file import calibration_payload, read_fit
from fitting.coefficients import FULL, QUICK, CoefficientFit, Effort, Restart, fit_coefficients
from fitting.ebt import EbtFit, fit_ebt, measured_tail_motion, tail_motion
from fitting.forecast import fit_phase, forecast
from fitting.frequency import SwimFrequency, estimate_frequency
from fitting.objective import MeanDistance, Swims
from fitting.scoring import Scores, residuals, score
from fitting.speed import forward_speed, whole_beats
from fitting.sweep import SpeedSweep, sweep_frequencies, sweep_speed
from fitting.trial import MeasuredTrial, measure_trial, tail_markers

__all__ = [
    "FULL",
    "QUICK",
    "CalibratedTrial",
    "Calibration",
    "CoefficientFit",
    "EbtFit",
    "Effort",
    "MeanDistance",
    "MeasuredTrial",
    "Restart",
    "Scores",
    "SpeedSweep",
    "Summary",
    "SwimFrequency",
    "Swims",
    "assemble",
    "calibrate",
    "calibration_payload",
    "estimate_frequency",
    "fit_coefficients",
    "fit_ebt",
    "fit_phase",
    "forecast",
    "forward_speed",
    "measure_trial",
    "measured_tail_motion",
    "read_fit",
    "residuals",
    "score",
    "sweep_frequencies",
    "sweep_speed",
    "tail_markers",
    "tail_motion",
    "whole_beats",
]
