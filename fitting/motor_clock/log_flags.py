"""What is doubtful about how a motor drove, by its own log."""

from collections.abc import Iterator

import numpy as np

from session import Flag, MotorLog

OFF_COMMAND = 0.05  # relative; beyond, the motor did not do what it was told
HOLE_S = 0.1  # without a reading; the crank may do anything in it
SAG = 0.1  # of the supply voltage, relative

ERRORS = {0: "input voltage", 2: "overheating", 3: "encoder", 4: "electrical shock", 5: "overload"}
"""Bits of the hardware error status (ROBOTIS e-Manual, XW540-T140-R)."""


def log_flags(log: MotorLog, drive_s: tuple[float, float], measured_hz: float, commanded_hz: float) -> tuple[Flag, ...]:
    """Doubts about a log.

    Args:
        log: as read.
        drive_s: the steady stretch, on the motor's clock, s.
        measured_hz, commanded_hz: turns a second over it; nan where not known.
    """
    return (*log.flags, *_doubts(log, drive_s, measured_hz, commanded_hz))


def _doubts(log: MotorLog, drive_s: tuple[float, float], measured_hz: float, commanded_hz: float) -> Iterator[Flag]:
    if bits := int(np.bitwise_or.reduce(np.nan_to_num(log.error).astype(int))):
        named = [ERRORS.get(bit, f"bit {bit}") for bit in range(bits.bit_length()) if bits >> bit & 1]
        yield Flag("motor_error", message=f"the motor reported: {', '.join(named)}")
    if commanded_hz > 0 and abs(measured_hz / commanded_hz - 1) > OFF_COMMAND:
        off = 100 * (measured_hz / commanded_hz - 1)
        message = f"the motor made {measured_hz:.3f} turns a second, {off:+.0f} % off the commanded {commanded_hz:.3g}"
        yield Flag("motor_slow", message=message)
    times = log.time_s[np.isfinite(log.position_rad)]
    times = times[(times >= drive_s[0]) & (times <= drive_s[1])]
    if (longest := float(np.diff(times).max(initial=0.0))) > HOLE_S:
        message = f"up to {longest:.2f} s of the drive without a reading; the crank is taken to turn smoothly there"
        yield Flag("log_gap", message=message)
    voltage = log.voltage_v[np.isfinite(log.voltage_v)]
    if len(voltage) and voltage.min() < (1 - SAG) * voltage.max():
        message = (
            f"the supply falls from {voltage.max():.1f} to {voltage.min():.1f} V; the motor slows down with it: "
            "is the supply strong enough?"
        )
        yield Flag("supply_sags", message=message)
