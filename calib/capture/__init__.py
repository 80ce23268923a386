"""Drives and logs the robot's motor, on the standard library and `dynamixel_sdk` alone.

It runs on the robot's Raspberry Pi as well as on a laptop, so nothing here imports any other part of the program.
"""

from calib.capture.command import main
from calib.capture.errors import CaptureError, MotorFault, UserError
from calib.capture.guard import Limits
from calib.capture.run import CaptureSettings, TrialResult, capture

__all__ = [
    "CaptureError",
    "CaptureSettings",
    "Limits",
    "MotorFault",
    "TrialResult",
    "UserError",
    "capture",
    "main",
]
