"""An emulated XW540-T140-R in velocity mode, as far as `calib capture` meets it: bytes in, bytes out.

Source: ROBOTIS e-manual, "Protocol 2.0" and "XW540-T140-R" (addresses, sizes, units, watchdog, 72 rpm, 6.9 N m and
4.9 A at 12 V). It follows the ramp of the profile up to the speed that the speed-torque line leaves it under its load;
inertia, supply and temperature are not emulated.
"""

import math
import threading
import time
from collections.abc import Callable
from random import Random
from typing import NamedTuple

from calib.motor.protocol import ALERT, BROADCAST_ID, ErrorNumber, Instruction, Packet, PacketReader, encode

RPM = 2 * math.pi / 60
NO_LOAD_RAD_S = 72 * RPM
STALL_NM = 6.9
STALL_A = 4.9
UNLIMITED_RAD_S2 = 700.0
"""Acceleration without a profile (assumed: that of the stall torque on 0.01 kg m^2)."""

VELOCITY_UNIT = 0.229 * RPM
ACCELERATION_UNIT = 214.577 * 2 * math.pi / 3600
CURRENT_UNIT = 2.69e-3
PULSES = 4096
TICK_WRAP = 32_768
WATCHDOG_UNIT_S = 0.02

VELOCITY_MODE = 1
EEPROM_END = 64
SIZE = 147


class Item(NamedTuple):
    """An entry of the control table, little-endian."""

    address: int
    size: int
    writable: bool = True
    signed: bool = False


ITEMS = {
    "model_number": Item(0, 2, writable=False),
    "firmware_version": Item(6, 1, writable=False),
    "drive_mode": Item(10, 1),
    "operating_mode": Item(11, 1),
    "velocity_limit": Item(44, 4),
    "torque_enable": Item(64, 1),
    "hardware_error_status": Item(70, 1, writable=False),
    "bus_watchdog": Item(98, 1, signed=True),
    "goal_velocity": Item(104, 4, signed=True),
    "profile_acceleration": Item(108, 4),
    "realtime_tick": Item(120, 2, writable=False),
    "present_current": Item(126, 2, writable=False, signed=True),
    "present_velocity": Item(128, 4, writable=False, signed=True),
    "present_position": Item(132, 4, writable=False, signed=True),
    "present_input_voltage": Item(144, 2, writable=False),
    "present_temperature": Item(146, 1, writable=False),
}
WRITABLE = {(item.address, item.size): name for name, item in ITEMS.items() if item.writable}
FACTORY = {
    "model_number": 1180,
    "firmware_version": 46,
    "operating_mode": 3,
    "velocity_limit": 304,
    "present_input_voltage": 120,
    "present_temperature": 25,
}


class Emulator:
    """One motor on a bus of its own: `motor["present_velocity"]` is the current value of an entry of its control table.

    It is safe to use from several threads.

    Args:
        motor_id: its id on the bus.
        clock: gives seconds and never runs backwards.
        load_nm: friction on the shaft, N m.
        seed: draws the angle it starts at and its tick.
    """

    reply_delay_s = 500e-6
    """Time between the end of an instruction and the start of its answer, which the caller keeps."""

    def __init__(
        self, motor_id: int = 1, clock: Callable[[], float] = time.monotonic, load_nm: float = 0.0, seed: int = 0
    ) -> None:
        draw = Random(seed)
        self.id, self.clock, self.load_nm = motor_id, clock, load_nm
        self.connected = True
        self._now = self._heard_at = clock()
        self._started_at = self._now - draw.uniform(1, 60)
        self._angle_rad, self._velocity_rad_s = draw.uniform(0, 2 * math.pi), 0.0
        self._memory = bytearray(SIZE)
        self._reader = PacketReader()
        self._lock = threading.RLock()
        for name, value in FACTORY.items():
            self._set(name, value)

    @property
    def stopped(self) -> bool:
        """Whether it is not being driven: torque off, or held at a speed of zero."""
        return self["torque_enable"] == 0 or self["goal_velocity"] == 0

    def __getitem__(self, name: str) -> int:
        with self._lock:
            self._advance()
            return self._get(name)

    def __setitem__(self, name: str, value: int) -> None:
        with self._lock:
            self._advance()
            self._set(name, value)

    def feed(self, data: bytes) -> bytes:
        """Take in bytes and return the answers: the status packets they ask for, in order; often none."""
        with self._lock:
            self._advance()
            return b"".join(map(self._hear, self._reader.push(data)))

    def _hear(self, packet: Packet) -> bytes:
        if packet.intact:
            self._heard_at = self._now
        if packet.id not in (self.id, BROADCAST_ID):
            return b""
        number, params = self._obey(packet)
        alert = ALERT if self._get("hardware_error_status") else 0
        return encode(Packet(self.id, Instruction.STATUS, bytes([alert | number]) + params))

    def _obey(self, packet: Packet) -> tuple[ErrorNumber, bytes]:
        """Follow an instruction; return error number and parameters of the answer."""
        if not packet.intact:
            return ErrorNumber.CRC, b""
        address, rest = int.from_bytes(packet.params[:2], "little"), packet.params[2:]
        match packet.instruction:
            case Instruction.PING:
                return ErrorNumber.NONE, bytes(self._memory[0:2] + self._memory[6:7])
            case Instruction.READ:
                end = address + int.from_bytes(rest, "little")
                return ErrorNumber.NONE, bytes(self._memory[address:end])
            case Instruction.WRITE:
                return self._write(address, rest), b""
        return ErrorNumber.INSTRUCTION, b""

    def _write(self, address: int, data: bytes) -> ErrorNumber:
        name = WRITABLE.get((address, len(data)))
        if name is None or (address < EEPROM_END and self._get("torque_enable")):
            return ErrorNumber.ACCESS
        value = int.from_bytes(data, "little", signed=ITEMS[name].signed)
        if name == "goal_velocity" and self._get("bus_watchdog") < 0:
            return ErrorNumber.DATA_RANGE
        if name == "goal_velocity" and abs(value) > self._get("velocity_limit"):
            return ErrorNumber.DATA_LIMIT
        if name == "operating_mode":
            self._set("profile_acceleration", 0)
            self._set("goal_velocity", 0)
        self._set(name, value)
        return ErrorNumber.NONE

    def _advance(self) -> None:
        """Bring the motor to the clock's time.

        Its watchdog acts when it is due: it stops the motor, with its torque on.
        """
        now = self.clock()
        watchdog = self._get("bus_watchdog")
        trips_at = self._heard_at + watchdog * WATCHDOG_UNIT_S
        if watchdog > 0 and self._get("torque_enable") and now >= trips_at:
            self._turn(max(0.0, trips_at - self._now))
            self._set("bus_watchdog", -1)
            self._set("profile_acceleration", 0)
            self._set("goal_velocity", 0)
        self._turn(now - self._now)
        self._set("realtime_tick", int((now - self._started_at) * 1000) % TICK_WRAP)
        self._set("present_velocity", round(self._velocity_rad_s / VELOCITY_UNIT))
        self._set("present_position", math.floor(self._angle_rad / (2 * math.pi) * PULSES))

    def _turn(self, duration_s: float) -> None:
        """Ramp to the goal, or the most that the load leaves of it, and turn on; without torque the gear stops it."""
        goal = 0.0
        if self._get("operating_mode") == VELOCITY_MODE:
            goal = self._get("goal_velocity") * VELOCITY_UNIT
        most = NO_LOAD_RAD_S * max(0.0, 1 - self.load_nm / STALL_NM)
        change = max(-most, min(goal, most)) - self._velocity_rad_s
        torque_nm = math.copysign(min(self.load_nm, STALL_NM), goal) if goal else 0.0
        if not self._get("torque_enable"):
            change = torque_nm = self._velocity_rad_s = 0.0
        acceleration = self._get("profile_acceleration") * ACCELERATION_UNIT or UNLIMITED_RAD_S2
        ramp_s = min(duration_s, abs(change) / acceleration)
        ramped = math.copysign(acceleration * ramp_s, change)
        self._angle_rad += (self._velocity_rad_s + ramped) * duration_s - 0.5 * ramped * ramp_s
        self._velocity_rad_s += ramped
        self._set("present_current", round(torque_nm / STALL_NM * STALL_A / CURRENT_UNIT))
        self._now += duration_s

    def _get(self, name: str) -> int:
        at, size = ITEMS[name].address, ITEMS[name].size
        return int.from_bytes(self._memory[at : at + size], "little", signed=ITEMS[name].signed)

    def _set(self, name: str, value: int) -> None:
        at, size = ITEMS[name].address, ITEMS[name].size
        self._memory[at : at + size] = (value % 256**size).to_bytes(size, "little")
