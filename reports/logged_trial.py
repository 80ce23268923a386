"""A trial whose motor was logged, as the report shows it: on the clock of the video, in turns of the crank."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fitting.motor_clock import MotorRecord

TURN = 2 * np.pi
BINS = 72  # bins of a turn


@dataclass(frozen=True, eq=False)
class LoggedTrial:
    """One dry run or swim with a motor log of n rows."""

    name: str
    kind: Literal["dry", "swim"]
    motor: MotorRecord

    @property
    def off_command(self) -> float:
        """Relative difference of the measured from the commanded speed; nan without a command."""
        hz = self.motor.commanded_hz
        return self.motor.measured_hz / hz - 1 if hz > 0 else float("nan")

    @property
    def speed(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,), s, and the motor's own speeds (n,), turns/s, positive as the crank turns on the whole."""
        log = self.motor.log
        return self._on_video(log.time_s), self._forward * log.velocity_rad_s / TURN

    @property
    def command(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Times (k,), s, and the speeds commanded then (k,), turns/s; None where they were not kept."""
        commands = self.motor.commands
        if commands is None:
            return None
        return self._on_video(commands.time_s), self._forward * commands.velocity_rad_s / TURN

    @property
    def codes(self) -> tuple[tuple[float, float], ...]:
        """Start and end of each coded wiggle, s."""
        commands = self.motor.commands
        spans = [commands.span_s(part) for part in ("start_code", "end_code")] if commands else []
        return tuple((float(a), float(b)) for a, b in (self._on_video(np.array(span)) for span in spans if span))

    @property
    def zero_s(self) -> float:
        """The time at which a time axis begins, s.

        It is the video's time 0, or the first row of a log that cannot be aligned with the video.
        """
        return 0.0 if self.motor.laid else float(self._on_video(self.motor.log.time_s)[0])

    @property
    def steady(self) -> np.ndarray:
        """Mask (n,) of the rows of the log within the steady stretch."""
        time_s, (start, end) = self._on_video(self.motor.log.time_s), self.motor.drive_s
        return (time_s >= start) & (time_s <= end)

    @property
    def turns(self) -> np.ndarray:
        """Speed over its mean (t, BINS), at even angles of the shaft, in each whole turn of the steady stretch."""
        motor = self.motor
        inside = self.steady & np.isfinite(motor.log.position_rad)
        if not inside.any():
            return np.zeros((0, BINS))
        time_s = self._on_video(motor.log.time_s[inside])
        turned = motor.turn.angle(time_s)
        angle = turned + np.median(self._forward * motor.log.position_rad[inside] - turned)
        whole = np.arange(np.ceil(angle[0] / TURN), np.floor(angle[-1] / TURN))
        places = TURN * (whole[:, None] + np.arange(BINS) / BINS)  # (t, BINS)
        return np.interp(places, angle, motor.turn.speed(time_s)) / (TURN * motor.measured_hz)

    @property
    def _forward(self) -> float:
        """The sign of the shaft's turning on the whole."""
        position = self.motor.log.position_rad[np.isfinite(self.motor.log.position_rad)]
        return -1.0 if len(position) and position[-1] < position[0] else 1.0

    def _on_video(self, motor_s: np.ndarray) -> np.ndarray:
        return (motor_s - self.motor.clock.offset_s) / self.motor.clock.rate
