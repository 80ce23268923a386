"""What estimates numbers: swim frequency and phase, fluid coefficients, elongated body theory, and their scores."""

from fitting.body_wave import BodyWave, SwimNumbers, body_wave, swim_numbers
from fitting.calibration import CalibratedTrial, Calibration, Summary, assemble, calibrate
from fitting.calibration_file import calibration_payload, read_fit, read_objective
from fitting.coefficient_fit import CoefficientFit, Restart
from fitting.coefficients import FULL, QUICK, Effort, fit_coefficients
from fitting.command_forecast import CommandForecast, beat_to_command, forecast_from_command
from fitting.course import Course, course_of
from fitting.ebt import EBT_RATIO_ONLY, FORMS, EbtFit, EbtForm, fit_ebt
from fitting.evidence import Evidence, YawFit, gather_evidence
from fitting.evidence_file import evidence_payload, read_evidence
from fitting.forecast import fit_phase, forecast
from fitting.frequency import SwimFrequency, estimate_frequency
from fitting.in_pool import tail_markers
from fitting.mean_distance import MeanDistance
from fitting.method_comparison import (
    SearchRun,
    compare_methods,
    comparison_payload,
    comparison_table,
    read_comparison,
)
from fitting.methods import METHODS, Method, MethodName, search
from fitting.objective import Comparison, Swims
from fitting.pairs import PairFit, fit_pairs
from fitting.placed_fit import PlacedFit, PlacedTrial
from fitting.placement import BoxesOff, Placement
from fitting.profile import CoefficientProfiles, profile_objective
from fitting.scoring import Scores, residuals, score
from fitting.speed import forward_speed, speed_standard_error, whole_beats
from fitting.speed_errors import Interval, SpeedErrors, speed_errors
from fitting.structure import Source, Structure, assumed
from fitting.sweep import SpeedSweep, sweep_frequencies, sweep_speed
from fitting.tail_tip import TailSwim, measured_tail, published_motion, simulated_tail, smoothed_motion, tip_motion
from fitting.trial import MeasuredTrial, measure_trial

__all__ = [
    "EBT_RATIO_ONLY",
    "FORMS",
    "FULL",
    "METHODS",
    "QUICK",
    "BodyWave",
    "BoxesOff",
    "CalibratedTrial",
    "Calibration",
    "CoefficientFit",
    "CoefficientProfiles",
    "CommandForecast",
    "Comparison",
    "Course",
    "EbtFit",
    "EbtForm",
    "Effort",
    "Evidence",
    "Interval",
    "MeanDistance",
    "MeasuredTrial",
    "Method",
    "MethodName",
    "PairFit",
    "PlacedFit",
    "PlacedTrial",
    "Placement",
    "Restart",
    "Scores",
    "SearchRun",
    "Source",
    "SpeedErrors",
    "SpeedSweep",
    "Structure",
    "Summary",
    "SwimFrequency",
    "SwimNumbers",
    "Swims",
    "TailSwim",
    "YawFit",
    "assemble",
    "assumed",
    "beat_to_command",
    "body_wave",
    "calibrate",
    "calibration_payload",
    "compare_methods",
    "comparison_payload",
    "comparison_table",
    "course_of",
    "estimate_frequency",
    "evidence_payload",
    "fit_coefficients",
    "fit_ebt",
    "fit_pairs",
    "fit_phase",
    "forecast",
    "forecast_from_command",
    "forward_speed",
    "gather_evidence",
    "measure_trial",
    "measured_tail",
    "profile_objective",
    "published_motion",
    "read_comparison",
    "read_evidence",
    "read_fit",
    "read_objective",
    "residuals",
    "score",
    "search",
    "simulated_tail",
    "smoothed_motion",
    "speed_errors",
    "speed_standard_error",
    "sweep_frequencies",
    "sweep_speed",
    "swim_numbers",
    "tail_markers",
    "tip_motion",
    "whole_beats",
]
