"""Motor logs whose truth is known: a crank that turns unevenly through each turn, framed by codes."""

from typing import Any, Literal

import numpy as np

from fitting.motor_clock import MotorClock, MotorRecord
from reports.context import LoggedTrial
from swimcal.motor_log import MotorCommands, MotorLog
from swimcal.runs import CrankTurn

OFFSET_S, RATE = 3.0, 1.001  # of the motor's clock against the video's
DRIVE_S = (2.0, 8.0)  # on the video's clock
SWING = 0.05  # of the speed, once a turn


def made_logged(
    name: str = "f0_60",
    hz: float = 0.6,
    kind: Literal["dry", "swim"] = "swim",
    forward: float = 1.0,
    coded: bool = True,
    **changes: Any,
) -> LoggedTrial:
    """A trial whose crank is 2 % slower than commanded, and turns by `SWING` unevenly about the shaft's zero."""
    time_s = np.arange(0.0, 10.0, 0.01)  # on the video's clock
    even = 2 * np.pi * hz * np.arange(0.0, 10.0, 1e-4)
    angle = np.interp(2 * np.pi * hz * time_s, even - SWING * np.sin(even), even)  # d angle/dt = hz/(1 - SWING cos)
    log_s = RATE * time_s + OFFSET_S
    log = MotorLog(
        time_s=log_s,
        position_rad=forward * angle,
        velocity_rad_s=forward * np.gradient(angle, log_s),
        current_a=np.full(len(time_s), -0.8),
        voltage_v=np.full(len(time_s), 11.9),
        temperature_c=np.linspace(25.0, 31.0, len(time_s)),
        error=np.zeros(len(time_s)),
    )
    reported_s = RATE * np.array([0.0, 0.5, 1.5, 2.0, 8.0, 8.5, 9.5]) + OFFSET_S
    parts = ("rest", "start_code", "rest", "drive", "rest", "end_code", "rest")
    reported = forward * 2 * np.pi * hz / 0.98 * np.array([0.0, 0.4, 0.0, 1.0, 0.0, -0.4, 0.0])
    record: dict[str, Any] = {
        "log": log,
        "commands": MotorCommands(reported_s, parts, reported) if coded else None,
        "clock": MotorClock(OFFSET_S, 0.0012, RATE, 2e-5, "code" if coded else "given", ()),
        "turn": CrankTurn.measured(log_s, log.position_rad).shifted(OFFSET_S, RATE),
        "drive_s": DRIVE_S,
        "measured_hz": hz,
        "commanded_hz": hz / 0.98,
        "ripple": SWING,
        "usable": True,
        "flags": (),
    }
    return LoggedTrial(name, kind, MotorRecord(**(record | changes)))
