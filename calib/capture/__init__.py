"""Drives and logs the robot's motor, on the standard library and `dynamixel_sdk` alone.

It runs on the robot's Raspberry Pi as well as on a laptop, so nothing here imports any other part of the program.
"""

from calib.capture.command import main
from calib.capture.errors import CaptureError, MotorFault, UserError
from calib.capture.functions import emulate, run, scan
from calib.capture.search import Found
from calib.capture.trials import TrialResult

__all__ = [
    "CaptureError",
    "Found",
    "MotorFault",
    "TrialResult",
    "UserError",
    "emulate",
    "main",
    "run",
    "scan",
]
