"""The motor on the bus, and the guard that always stops it.

`Motor` is made ready, driven, read and, above all, stopped. `Guard` has it stopped before it harms itself, the robot or
the measurement.
"""

import math
import struct
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

from calib.capture import registers
from calib.capture.bus import Bus, Clock, MotorFault, NoAnswer, UserError
from calib.capture.registers import Telemetry, TurnCounter

# `Motor`.
WATCHDOG = 20
SILENCE_S = WATCHDOG * registers.WATCHDOG_S
"""Time without a packet from the host after which the motor stops by itself."""

ACCELERATION_TURNS_PER_S2 = 4.0
STOP_TRIES = 8
BETWEEN_TRIES_S = 0.02

# `Freshness`: the clocks of motor and host.
TICK_S = 0.001
SLOW_S = 0.01  # an exchange that takes this much longer than the shortest one has an unsure time
DRIFT = 0.02  # largest drift between the two clocks, s/s

# `Guard`.
PATIENCE_S = 0.5  # how long a current too high, or a speed of less than half the command, is tolerated
CLOCK_TOLERANCE_S = 0.02  # largest jump of the motor's clock, in addition to the duration of two exchanges
RISE_S = 1.0  # time after a new command before the speed counts
SLOWEST_WATCHED_TURNS_PER_S = 0.05


class Reading(NamedTuple):
    """One reading of the motor.

    Attributes:
        time_s: the host's clock, halfway between question and answer.
        took_s: duration of the exchange, all tries together.
        timely: whether the first answer was whole, fresh and quick. If not, its time is unsure.
    """

    time_s: float
    took_s: float
    measured: Telemetry
    hardware_error: int = 0
    timely: bool = True


class Motor:
    """A Dynamixel XW540-T140-R in velocity mode."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self.bus = bus
        self._clock = clock
        self._freshness = Freshness()

    def identify(self) -> None:
        """Check that this is the intended motor, and that it is well.

        Raises:
            UserError: nobody answers, or another model.
            MotorFault: the motor has shut itself down.
        """
        try:
            model = self.bus.ping()
        except NoAnswer as error:
            raise UserError(
                f"no motor with id {self.bus.motor_id} answers; found: {error}. `calib capture scan` finds its "
                "baud rate and id."
            ) from error
        if model != registers.MODEL:
            raise UserError(
                f"the motor with id {self.bus.motor_id} is another model; found: {model}; expected: {registers.MODEL}, "
                "the XW540-T140-R. `calib capture scan` lists the motors."
            )
        if bits := self.hardware_error():
            raise MotorFault(
                f"the motor has shut itself down: {registers.describe_hardware_error(bits)}. Mend the cause, then "
                "take its power away and give it again."
            )

    def prepare(self, fastest_turns_per_s: float) -> None:
        """Set velocity mode, speed limit, acceleration and watchdog, and switch the torque on, at rest.

        What is set is read back. EEPROM is written only where it differs.

        Raises:
            MotorFault: no answer, a refusal, or a value that does not stay.
        """
        self._freshness = Freshness()
        self.bus.write(registers.TORQUE_ENABLE, 0)
        self.bus.write(registers.BUS_WATCHDOG, 0)  # this clears a trip, after which goals cannot be written
        self._settle_settings(registers.velocity_units(fastest_turns_per_s))
        acceleration = registers.acceleration_units(ACCELERATION_TURNS_PER_S2)
        self.bus.write(registers.PROFILE_ACCELERATION, acceleration)
        self.bus.write(registers.GOAL_VELOCITY, 0)
        self.bus.write(registers.BUS_WATCHDOG, WATCHDOG)
        self.bus.write(registers.TORQUE_ENABLE, 1)
        goal_velocity, set_to = struct.unpack("<4xii4x", self.bus.read(registers.GOALS).data)
        found = self.bus.read(registers.BUS_WATCHDOG).data[0], goal_velocity, set_to
        if found != (WATCHDOG, 0, acceleration) or not self._torque():
            raise MotorFault(
                "the motor does not keep its settings; found: watchdog, goal velocity and acceleration "
                f"{found}; expected: {(WATCHDOG, 0, acceleration)}, with the torque on"
            )

    def set_speed(self, units: int) -> float:
        """Set the goal velocity, in its units, and return the host's time at which that was done.

        Raises:
            MotorFault: no answer, or a refusal: after a trip of the watchdog, for one.
        """
        before = self._clock.now()
        try:
            self.bus.write(registers.GOAL_VELOCITY, units)
        except MotorFault as fault:
            raise self._explain(fault) from fault
        return (before + self._clock.now()) / 2

    def read(self) -> Reading:
        """Read what the motor measures, in one exchange.

        Raises:
            MotorFault: no answer.
        """
        damaged = self.bus.damaged
        before = self._clock.now()
        answer = self.bus.read(registers.MEASURED)
        after = self._clock.now()
        whole = self.bus.damaged == damaged
        measured = registers.decode_measured(answer.data)
        time_s, took_s = (before + after) / 2, after - before
        fresh = self._freshness.is_fresh(measured.tick, time_s, took_s)
        bits = self.hardware_error() if answer.alert else 0
        return Reading(time_s, took_s, measured, bits, whole and fresh)

    def hardware_error(self) -> int:
        """Read the bits of the hardware error status."""
        return self.bus.read(registers.HARDWARE_ERROR).data[-1]

    def stop(self) -> bool:
        """Switch the torque off, whatever happened before; return whether the motor confirmed it.

        Never raises: it is asked again and again, and where nothing helps the watchdog stops the motor within
        `SILENCE_S` of the last packet that reached it.
        """
        for _ in range(STOP_TRIES):
            try:
                self.bus.write(registers.TORQUE_ENABLE, 0, tries=1)
                if not self._torque():
                    with suppress(Exception):  # the next user of the motor should not find its watchdog tripped
                        self.bus.write(registers.BUS_WATCHDOG, 0, tries=2)
                    return True
            except Exception:
                pass
            self._clock.sleep(BETWEEN_TRIES_S)
        return False

    def _settle_settings(self, velocity_limit: int) -> None:
        """Write the EEPROM: velocity mode, profiles in units of speed, the direction kept as it is, and the speed
        limit.
        """
        found = self._settings()
        wanted = (found[0] & registers.REVERSED, registers.VELOCITY_MODE, velocity_limit)
        for register, value, now in zip(
            (registers.DRIVE_MODE, registers.OPERATING_MODE, registers.VELOCITY_LIMIT), wanted, found, strict=True
        ):
            if now != value:
                self.bus.write(register, value)
        found = self._settings()
        if found != wanted:
            raise MotorFault(
                f"the motor does not keep its settings; found: drive mode, operating mode and velocity limit {found}; "
                f"expected: {wanted}"
            )

    def _settings(self) -> tuple[int, int, int]:
        drive_mode, operating_mode = self.bus.read(registers.MODES).data[:2]
        return drive_mode, operating_mode, int.from_bytes(self.bus.read(registers.LIMITS).data[:4], "little")

    def _torque(self) -> bool:
        return bool(self.bus.read(registers.TORQUE_ENABLE, tries=2).data[0])

    def _explain(self, fault: MotorFault) -> MotorFault:
        """Return the fault; where the watchdog has tripped, one that says so."""
        try:
            tripped = self.bus.read(registers.BUS_WATCHDOG).data[0] == registers.TRIPPED
        except MotorFault:
            return fault
        if not tripped:
            return fault
        return MotorFault(
            f"the motor's bus watchdog has stopped it: it heard nothing for {SILENCE_S:g} s. "
            "Was this program suspended, or the computer too busy? Start again."
        )


class Freshness:
    """A detector of answers to earlier questions, for which the motor's clock is behind.

    A reading is taken somewhere between question and answer, so that motor clock minus host clock, taken halfway, is
    right within half the duration of the exchange. A reading that is further behind than that explains is stale; one
    that took long is fresh, but nobody knows when it was taken.
    """

    def __init__(self) -> None:
        self._tick = TurnCounter(registers.TICKS)
        self._reference: tuple[float, float, float] | None = None
        self._shortest_s = math.inf

    def is_fresh(self, tick: int, time_s: float, took_s: float) -> bool:
        """Judge a reading by its tick, the host's time halfway, and the duration of the exchange."""
        self._shortest_s = min(self._shortest_s, took_s)
        off_s = self._tick.follow(tick) * TICK_S - time_s
        if self._reference is not None:
            last_off_s, last_s, last_took_s = self._reference
            allowed_s = 2 * TICK_S + (took_s + last_took_s) / 2 + DRIFT * (time_s - last_s)
            if off_s < last_off_s - allowed_s:
                return False
        self._reference = (off_s, time_s, took_s)
        return took_s <= self._shortest_s + SLOW_S


@dataclass(frozen=True)
class Limits:
    """The limits beyond which the motor is stopped.

    Attributes:
        current_a: largest current, borne for `PATIENCE_S`.
        temperature_c: largest temperature, at once. The motor's own limit is 80.
    """

    current_a: float = 3.5
    temperature_c: float = 70.0


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
