"""The motor: made ready, driven, read and, above all, stopped."""

import math
import struct
from contextlib import suppress
from typing import NamedTuple

from calib.capture import registers
from calib.capture.bus import Bus
from calib.capture.errors import MotorFault, NoAnswer, UserError
from calib.capture.host import Clock
from calib.capture.registers import Telemetry, TurnCounter

WATCHDOG = 20
SILENCE_S = WATCHDOG * registers.WATCHDOG_S
"""Time without a packet from the host after which the motor stops by itself."""

ACCELERATION_TURNS_PER_S2 = 4.0
STOP_TRIES = 8
BETWEEN_TRIES_S = 0.02


TICK_S = 0.001
SLOW_S = 0.01  # an exchange that takes this much longer than the shortest one has an unsure time
DRIFT = 0.02  # largest drift between the two clocks, s/s


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
