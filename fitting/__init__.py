"""What estimates numbers: swim frequency and phase, fluid coefficients, elongated body theory, and their scores."""

from fitting.calibration import CalibratedTrial, Calibration, Summary, assemble, calibrate, speeds_of
from fitting.calibration_file import calibration_payload, read_fit
from fitting.coefficients import FULL, QUICK, CoefficientFit, Effort, Restart, fit_coefficients
from fitting.ebt import FORMS, EbtFit, EbtForm, fit_ebt
from fitting.forecast import fit_phase, forecast
from fitting.frequency import SwimFrequency, estimate_frequency
from fitting.objective import MeanDistance, Swims
from fitting.scoring import Scores, residuals, score
from fitting.speed import forward_speed, whole_beats
from fitting.sweep import SpeedSweep, sweep_frequencies, sweep_speed
from fitting.tail_tip import TailSwim, measured_tail, published_motion, simulated_tail, smoothed_motion, tip_motion
from fitting.trial import MeasuredTrial, measure_trial, tail_markers

__all__ = [
    "FORMS",
    "FULL",
    "QUICK",
    "CalibratedTrial",
    "Calibration",
    "CoefficientFit",
    "EbtFit",
    "EbtForm",
    "Effort",
    "MeanDistance",
    "MeasuredTrial",
    "Restart",
    "Scores",
    "SpeedSweep",
    "Summary",
    "SwimFrequency",
    "Swims",
    "TailSwim",
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
    "measured_tail",
    "published_motion",
    "read_fit",
    "residuals",
    "score",
    "simulated_tail",
    "smoothed_motion",
    "speeds_of",
    "sweep_frequencies",
    "sweep_speed",
    "tail_markers",
    "tip_motion",
    "whole_beats",
]
