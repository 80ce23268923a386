"""What estimates numbers: swim frequency and phase, fluid coefficients, elongated body theory, and their scores."""

from fitting.body_wave import BodyWave, SwimNumbers, body_wave, swim_numbers
from fitting.calibration import CalibratedTrial, Calibration, Summary, assemble, calibrate
from fitting.calibration_file import CALIBRATION, CalibrationResult, calibration_result
from fitting.coefficient_fit import CoefficientFit
from fitting.coefficients import FULL, QUICK
from fitting.command_forecast import CommandForecast, beat_to_command, forecast_from_command
from fitting.course import course_of
from fitting.ebt import EBT_RATIO_ONLY, FORMS
from fitting.evidence import EVIDENCE, Evidence, YawFit, gather_evidence
from fitting.in_pool import tail_markers
from fitting.methods import METHODS, MethodName
from fitting.objective import Comparison
from fitting.pairs import PairFit
from fitting.placed_fit import PlacedFit
from fitting.placement import Placement
from fitting.profile import CoefficientProfiles
from fitting.scoring import residuals
from fitting.speed import forward_speed, whole_beats
from fitting.speed_errors import Interval, SpeedErrors, speed_errors
from fitting.structure import Source, Structure
from fitting.sweep import SpeedSweep
from fitting.trial import MeasuredTrial, measure_trial

__all__ = [
    "CALIBRATION",
    "EBT_RATIO_ONLY",
    "EVIDENCE",
    "FORMS",
    "FULL",
    "METHODS",
    "QUICK",
    "BodyWave",
    "CalibratedTrial",
    "Calibration",
    "CalibrationResult",
    "CoefficientFit",
    "CoefficientProfiles",
    "CommandForecast",
    "Comparison",
    "Evidence",
    "Interval",
    "MeasuredTrial",
    "MethodName",
    "PairFit",
    "PlacedFit",
    "Placement",
    "Source",
    "SpeedErrors",
    "SpeedSweep",
    "Structure",
    "Summary",
    "SwimNumbers",
    "YawFit",
    "assemble",
    "beat_to_command",
    "body_wave",
    "calibrate",
    "calibration_result",
    "course_of",
    "forecast_from_command",
    "forward_speed",
    "gather_evidence",
    "measure_trial",
    "residuals",
    "speed_errors",
    "swim_numbers",
    "tail_markers",
    "whole_beats",
]
