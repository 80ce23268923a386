"""The guard of the motor: it is stopped before it harms itself, the robot or the measurement."""

from dataclasses import dataclass

from calib.capture import registers
from calib.capture.errors import MotorFault
from calib.capture.motor import Reading
from calib.capture.registers import TurnCounter


@dataclass(frozen=True)
class Limits:
    """The limits beyond which the motor is stopped.

    Attributes:
        current_a: largest current, borne for `PATIENCE_S`.
        temperature_c: largest temperature, at once. The motor's own limit is 80.
    """

    current_a: float = 3.5
    temperature_c: float = 70.0


PATIENCE_S = 0.5  # how long a current too high, or a speed of less than half the command, is tolerated
CLOCK_TOLERANCE_S = 0.02  # largest jump of the motor's clock, in addition to the duration of two exchanges
RISE_S = 1.0  # time after a new command before the speed counts
SLOWEST_WATCHED_TURNS_PER_S = 0.05


class Guard:
    """A judge of one reading after the other."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._tick = TurnCounter(registers.TICKS)
        self._last: tuple[Reading, int] | None = None
        self._goal = 0
        self._goal_s = float("-inf")
        self._over_s: float | None = None
        self._slow_s: float | None = None

    def command(self, units: int, time_s: float) -> None:
        """Take note of a new goal velocity."""
        self._goal, self._goal_s, self._slow_s = units, time_s, None

    def check(self, reading: Reading) -> None:
        """Judge a reading; raise the `MotorFault` for which the motor must stop."""
        if reading.hardware_error:
            raise MotorFault(f"the motor reports: {registers.describe_hardware_error(reading.hardware_error)}")
        self._check_temperature(reading)
        self._check_current(reading)
        self._check_speed(reading)
        self._check_clock(reading)

    def _check_temperature(self, reading: Reading) -> None:
        celsius = reading.measured.temperature
        if celsius > self._limits.temperature_c:
            raise MotorFault(
                f"the motor is too warm; found: {celsius} degrees C; expected: at most {self._limits.temperature_c:g} "
                "(--max-temperature). Let it cool down."
            )

    def _check_current(self, reading: Reading) -> None:
        ampere = abs(reading.measured.current) * registers.AMPERE
        if ampere <= self._limits.current_a:
            self._over_s = None
            return
        self._over_s = reading.time_s if self._over_s is None else self._over_s
        if reading.time_s - self._over_s >= PATIENCE_S:
            raise MotorFault(
                f"the current is too high; found: {ampere:.2f} A for {PATIENCE_S:g} s; expected: at most "
                f"{self._limits.current_a:g} A (--max-current). Does the tail move freely?"
            )

    def _check_speed(self, reading: Reading) -> None:
        watched = abs(registers.turns_per_s(self._goal)) >= SLOWEST_WATCHED_TURNS_PER_S
        forward = reading.measured.velocity * (1 if self._goal > 0 else -1)
        if not watched or forward >= abs(self._goal) / 2 or reading.time_s - self._goal_s < RISE_S:
            self._slow_s = None
            return
        self._slow_s = reading.time_s if self._slow_s is None else self._slow_s
        if reading.time_s - self._slow_s >= PATIENCE_S:
            raise MotorFault(
                "the motor does not follow; found: "
                f"{registers.turns_per_s(reading.measured.velocity):.2f} turns/s; expected: near "
                f"{registers.turns_per_s(self._goal):.2f}. Is it blocked, or its torque switched off?"
            )

    def _check_clock(self, reading: Reading) -> None:
        """Check that the motor's clock runs as the host's does; it starts anew when the motor does."""
        tick = self._tick.follow(reading.measured.tick)
        if self._last is not None:
            before, last_tick = self._last
            off_s = (tick - last_tick) / 1000 - (reading.time_s - before.time_s)
            if abs(off_s) > CLOCK_TOLERANCE_S + before.took_s + reading.took_s:
                raise MotorFault(
                    f"the motor's clock jumped by {off_s:+.3f} s: it has started anew, or its answers come too late. "
                    "Check its supply."
                )
        self._last = (reading, tick)
