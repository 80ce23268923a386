"""Drives and logs the robot's motor, on the standard library and `dynamixel_sdk` alone.

It runs on the robot's Raspberry Pi as well as on a laptop, so nothing here imports any other part of the program.
"""

from calib.capture.command import main
from calib.capture.errors import CaptureError, Interrupted, MotorFault, NoAnswer, UserError
from calib.capture.guard import Limits
from calib.capture.host import Clock
from calib.capture.logs import COMMANDS_HEADER, MOTOR_HEADER
from calib.capture.plan import CHIP_S, CHIP_TURNS_PER_S, END_CODE, START_CODE
from calib.capture.run import CaptureSettings, TrialResult, capture
from calib.capture.scan import Found, scan

__all__ = [
    "CHIP_S",
    "CHIP_TURNS_PER_S",
    "COMMANDS_HEADER",
    "END_CODE",
    "MOTOR_HEADER",
    "START_CODE",
    "CaptureError",
    "CaptureSettings",
    "Clock",
    "Found",
    "Interrupted",
    "Limits",
    "MotorFault",
    "NoAnswer",
    "TrialResult",
    "UserError",
    "capture",
    "main",
    "scan",
]
