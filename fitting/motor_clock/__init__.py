"""The motor's log on the clock of the video, found by the codes that both have seen."""

from fitting.motor_clock.record import MotorRecord, read_motor

__all__ = [
    "MotorRecord",
    "read_motor",
]
