"""The motor's log on the clock of the video: found by the codes that both have seen."""

from fitting.motor_clock.clock import MotorClock, find_clock
from fitting.motor_clock.record import RISE_S, MotorRecord, motor_record, read_motor
from fitting.motor_clock.tail_motion import TailMotion, tail_motion

__all__ = [
    "RISE_S",
    "MotorClock",
    "MotorRecord",
    "TailMotion",
    "find_clock",
    "motor_record",
    "read_motor",
    "tail_motion",
]
