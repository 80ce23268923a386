"""The servo without its serial line: control table and motor joined, with watchdog, protections and virtual time.

Source: ROBOTIS e-manual, "XW540-T140-R". Where the manual is silent the servo does what is harder on its host, and
it is in the docstring. It turns in velocity mode (1) only; in the other modes it holds.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntFlag
from random import Random

from calib.motor.control_table import ControlTable, Refusal
from calib.motor.motor_physics import RPM, MotorPhysics
from calib.motor.protocol import ErrorNumber

VELOCITY_MODE = 1
VELOCITY_UNIT = 0.229 * RPM
"""rad/s a unit of Goal, Present and Limit Velocity."""
ACCELERATION_UNIT = 214.577 * 2 * math.pi / 3600
"""rad/s^2 a unit of Profile Acceleration (214.577 rev/min^2)."""
CURRENT_UNIT = 2.69e-3
"""A a unit of Present Current and Current Limit."""
PULSES = 4096
"""Pulses a turn."""
TICK_WRAP = 32_768
WATCHDOG_UNIT_S = 0.02
BOOT_S = 0.3
"""Time without an answer after a reboot (assumed; the manual gives none)."""
OVERLOAD_S = 1.0
"""How long more than 80 % of the stall torque is borne before Overload (assumed; in the manual "persistent")."""
CHECK_S = 0.05
VOLTAGE_V, HOTTEST_C = (9.5, 16.0), 80
"""Limits as from the factory."""


class HardwareError(IntFlag):
    """Bits of Hardware Error Status (70)."""

    INPUT_VOLTAGE = 1
    OVERHEATING = 4
    ENCODER = 8
    ELECTRICAL_SHOCK = 16
    OVERLOAD = 32


SHUTDOWN = HardwareError.OVERHEATING | HardwareError.ELECTRICAL_SHOCK | HardwareError.OVERLOAD
"""Errors that switch torque off, as from the factory: Shutdown (63)."""


@dataclass(frozen=True)
class MotorState:
    """What the motor truly does at this moment (not quantised). `goal_velocity_rad_s` is what it is driven towards."""

    position_rad: float
    velocity_rad_s: float
    goal_velocity_rad_s: float
    temperature_c: float
    torque_enabled: bool
    watchdog_tripped: bool
    hardware_error: HardwareError


class Servo:
    """Control table and motor at the time of a clock (seconds, never backwards). `advance` first, then ask."""

    def __init__(self, physics: MotorPhysics, clock: Callable[[], float], random: Random) -> None:
        self.table = ControlTable()
        self.physics = physics
        self.clock = clock
        self.now = self.heard_at = clock()
        self._random = random
        self._ready_at = self.now - random.uniform(1, 60)

    @property
    def ready(self) -> bool:
        """False while it boots."""
        return self.now >= self._ready_at

    @property
    def state(self) -> MotorState:
        """What the motor truly does now."""
        physics, drive = self.physics, self.physics.drive
        return MotorState(
            position_rad=physics.angle_rad,
            velocity_rad_s=physics.velocity_rad_s,
            goal_velocity_rad_s=drive.goal_rad_s if drive.enabled else 0.0,
            temperature_c=physics.temperature_c,
            torque_enabled=drive.enabled,
            watchdog_tripped=self.table["bus_watchdog"] < 0,
            hardware_error=HardwareError(self.table["hardware_error_status"]),
        )

    def advance(self) -> None:
        """Brings the motor to the clock's time; the watchdog and the protections act when they are due."""
        now = self.clock()
        while self.now < now:
            until = min(now, self.now + CHECK_S, max(self.now, self._watchdog_at()))
            self.physics.advance(until - self.now)
            self.now = until
            self._protect()
            if self.now >= self._watchdog_at():
                self._trip()

    def write(self, values: dict[str, int]) -> None:
        """Takes over checked values ({entry: value}) with all they bring about.

        A goal velocity from before torque on is kept and driven to at once (the manual is silent). Torque on after a
        shutdown fails until a reboot; a change of mode resets profile and goals.

        Raises:
            Refusal: RESULT_FAIL for torque on after a shutdown.
        """
        table = self.table
        if values.get("torque_enable") and table["hardware_error_status"] & SHUTDOWN:
            raise Refusal(ErrorNumber.RESULT_FAIL)
        for name, value in values.items():
            table[name] = value
        if "operating_mode" in values:
            table["profile_velocity"] = table["profile_acceleration"] = table["goal_velocity"] = 0
        self._command()

    def raise_error(self, error: HardwareError) -> None:
        """Raises a hardware error; one of those in `SHUTDOWN` switches torque off."""
        self.table["hardware_error_status"] |= error
        if error & SHUTDOWN:
            self.table["torque_enable"] = 0
            self._command()

    def restart(self) -> None:
        """Boots anew: RAM back to its initial values, torque off, errors gone, whole turns forgotten."""
        self.table.restart()
        self.physics.angle_rad %= 2 * math.pi
        self._command()
        self._ready_at = self.now + BOOT_S

    def publish(self) -> None:
        """Puts what is measured now into the table, in its units; the current ripples by one unit (sd)."""
        table, physics, sign = self.table, self.physics, self._sign
        ripple = self._random.gauss(0, 1) if physics.torque_nm else 0.0
        table["realtime_tick"] = int((self.now - self._ready_at) * 1000) % TICK_WRAP
        table["present_current"] = round(sign * physics.current_a / CURRENT_UNIT + ripple)
        table["present_velocity"] = round(sign * physics.velocity_rad_s / VELOCITY_UNIT)
        table["present_position"] = math.floor(sign * physics.angle_rad / (2 * math.pi) * PULSES)
        table["present_input_voltage"] = round(physics.supply_v * 10)
        table["present_temperature"] = round(physics.temperature_c)

    def _command(self) -> None:
        table, drive = self.table, self.physics.drive
        drive.enabled = bool(table["torque_enable"])
        turning = table["operating_mode"] == VELOCITY_MODE
        drive.goal_rad_s = self._sign * table["goal_velocity"] * VELOCITY_UNIT if turning else 0.0
        drive.acceleration_rad_s2 = table["profile_acceleration"] * ACCELERATION_UNIT or math.inf

    @property
    def _sign(self) -> int:
        """-1 in reverse mode (bit 0 of Drive Mode)."""
        return -1 if self.table["drive_mode"] & 1 else 1

    def _watchdog_at(self) -> float:
        """When the bus watchdog trips, should no more instructions come: it watches while torque is on."""
        units = self.table["bus_watchdog"]
        watching = units > 0 and self.table["torque_enable"]
        return self.heard_at + units * WATCHDOG_UNIT_S if watching else math.inf

    def _trip(self) -> None:
        """Stops at once (profile acceleration counts as 0), torque stays on; goals are refused until 0 is written."""
        self.table["bus_watchdog"] = -1
        self.table["goal_velocity"] = self.table["profile_acceleration"] = self.table["profile_velocity"] = 0
        self._command()

    def _protect(self) -> None:
        physics, found = self.physics, HardwareError(0)
        if not VOLTAGE_V[0] <= physics.supply_v <= VOLTAGE_V[1]:
            found |= HardwareError.INPUT_VOLTAGE
        if physics.temperature_c > HOTTEST_C:
            found |= HardwareError.OVERHEATING
        if physics.overloaded_s > OVERLOAD_S:
            found |= HardwareError.OVERLOAD
        if found:
            self.raise_error(found)
