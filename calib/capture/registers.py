"""The control table of the Dynamixel XW540-T140-R, as far as it is used here, and the units of its values.

Source: ROBOTIS e-Manual, XW540-T140-R. Everything below address 64 is EEPROM, writable with torque off only.
"""

import math
import struct
from typing import NamedTuple

MODEL = 1180
"""The model number that the XW540-T140-R answers a ping with."""

VELOCITY_MODE = 1
REVERSED = 0x01  # bit of the drive mode; other bits base the profile on time, or switch torque on with every goal
TRIPPED = 0xFF  # value of the watchdog after a trip, -1

RPM = 0.229  # unit of velocity
RPM_PER_MIN = 214.577  # unit of profile acceleration, rev/min^2
PULSES = 4096  # pulses of the encoder in a turn
AMPERE = 2.69e-3  # unit of current
VOLT = 0.1  # unit of voltage
WATCHDOG_S = 0.020  # unit of the bus watchdog
TICKS = 32768  # the realtime tick counts milliseconds up to 32767

RATED_TURNS_PER_S = 72 / 60  # speed without load at RATED_V
RATED_V = 12.0

HARDWARE_ERRORS = {
    0x01: "input voltage out of range",
    0x04: "overheated",
    0x08: "encoder fault",
    0x10: "electrical shock or not enough power",
    0x20: "overload",
}
"""The bits of the hardware error status."""


class Register(NamedTuple):
    """One entry of the control table: its address, size in bytes and name in messages."""

    address: int
    size: int
    name: str


DRIVE_MODE = Register(10, 1, "drive mode")
OPERATING_MODE = Register(11, 1, "operating mode")
VELOCITY_LIMIT = Register(44, 4, "velocity limit")
TORQUE_ENABLE = Register(64, 1, "torque")
BUS_WATCHDOG = Register(98, 1, "bus watchdog")
GOAL_VELOCITY = Register(104, 4, "goal velocity")
PROFILE_ACCELERATION = Register(108, 4, "profile acceleration")

MODES = Register(10, 4, "drive and operating mode")
LIMITS = Register(44, 12, "velocity limit")
HARDWARE_ERROR = Register(69, 2, "hardware error")
GOALS = Register(100, 16, "goals")
MEASURED = Register(120, 27, "measured values")
"""Blocks of entries without gaps. Everything read has a length of its own (a ping's answer has 3), so that no late
answer passes for that to another question; only torque and watchdog share one, and a watchdog that was set never reads
as torque off."""


class Telemetry(NamedTuple):
    """One reading of the motor, in the units of the control table, signed; position and tick wrap.

    Attributes:
        tick: milliseconds on the motor's clock, 0 to 32767.
        current: in units of 2.69 mA.
        velocity: in units of 0.229 rpm.
        position: in pulses of 1/4096 turn.
        voltage: in units of 0.1 V.
        temperature: degrees Celsius.
    """

    tick: int
    current: int
    velocity: int
    position: int
    voltage: int
    temperature: int


def decode_measured(data: bytes) -> Telemetry:
    """Decode the 27 bytes from address 120 on."""
    return Telemetry(*struct.unpack("<H4xhii8xHB", data))


def velocity_units(turns_per_s: float) -> int:
    """Convert a speed to the unit of the goal velocity."""
    return round(turns_per_s * 60 / RPM)


def turns_per_s(units: int) -> float:
    """Convert a goal or measured velocity to turns a second."""
    return units * RPM / 60


def rad_per_s(units: int) -> float:
    """Convert a goal or measured velocity to rad/s."""
    return 2 * math.pi * turns_per_s(units)


def acceleration_units(turns_per_s2: float) -> int:
    """Convert an acceleration to the unit of the profile acceleration; never 0, which would mean no limit."""
    return max(1, round(turns_per_s2 * 3600 / RPM_PER_MIN))


def reach_turns_per_s(voltage_v: float) -> float:
    """Compute the fastest speed without load: 72 rpm at 12 V, in proportion to the voltage."""
    return RATED_TURNS_PER_S * voltage_v / RATED_V


def describe_hardware_error(bits: int) -> str:
    """Describe the hardware error status in words."""
    known = [text for bit, text in HARDWARE_ERRORS.items() if bits & bit]
    return ", ".join(known) if known else f"unknown error {bits:#04x}"


class TurnCounter:
    """A counter of `modulus` steps, followed over its wraps.

    Between two values it must move by less than half the modulus, either way.
    """

    def __init__(self, modulus: int) -> None:
        self._modulus = modulus
        self._total: int | None = None

    def follow(self, value: int) -> int:
        """Return the count that continues the one before; the first value is taken as it is."""
        if self._total is None:
            self._total = value
        else:
            half = self._modulus // 2
            self._total += (value - self._total + half) % self._modulus - half
        return self._total
