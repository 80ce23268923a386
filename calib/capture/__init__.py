"""The driver and logger of the robot's motor, on the standard library and `dynamixel_sdk` alone.

It runs on the robot's Raspberry Pi as well as on a laptop, so nothing here imports any other part of the program.

Example:
    >>> motor = calib.capture.scan(["/dev/ttyUSB0"], [57600])[0]
    >>> driven = calib.capture.run(motor.port, "0.6,0.8", "logged", seconds=3.0, report=lambda line: None)
    >>> [(trial.name, round(trial.measured_hz, 1)) for trial in driven]
    [('f0_60', 0.6), ('f0_80', 0.8)]
"""

from calib.capture.bus import CaptureError, MotorFault, UserError
from calib.capture.functions import emulate, run, scan
from calib.capture.trials import Found, TrialResult

__all__ = [
    "CaptureError",
    "Found",
    "MotorFault",
    "TrialResult",
    "UserError",
    "emulate",
    "run",
    "scan",
]
