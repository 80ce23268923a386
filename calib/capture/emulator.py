"""An emulator of the robot's motor, a DYNAMIXEL XW540-T140-R, for trying `calib capture` without one.

It is written from ROBOTIS' e-manuals without their SDK, so that the two can be tested against each other; it needs the
standard library only.

`BusPacket`, `encode` and `PacketReader` are the packets of DYNAMIXEL Protocol 2.0: header, byte stuffing, CRC-16.
Source: "Protocol 2.0" (packet fields, processing order, error numbers) and "CRC calculation".

`MotorEmulator` is the motor in velocity mode, as far as `calib capture` meets it: bytes in, bytes out. Source:
"Protocol 2.0" and "XW540-T140-R" (addresses, sizes, units, watchdog, 72 rpm, 6.9 N m and 4.9 A at 12 V). It follows the
ramp of the profile up to the speed that the speed-torque line leaves it under its load; inertia, supply and temperature
are not emulated.

`pseudo_terminal` puts it behind a pseudo-terminal: any program that opens a serial port can talk to it (Linux, macOS).
"""

import math
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from random import Random
from typing import NamedTuple

if sys.platform != "win32":
    import termios
    import tty

# Packets.
HEADER = b"\xff\xff\xfd\x00"
BROADCAST_ID = 0xFE
ALERT = 0x80
"""Bit of the error byte that means that Hardware Error Status (70) is not zero."""

STUFFED = b"\xff\xff\xfd\xfd"
PLAIN = b"\xff\xff\xfd"

# The motor: its speed-torque line and its units.
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

# The control table.
VELOCITY_MODE = 1
EEPROM_END = 64
SIZE = 147

FACTORY = {
    "model_number": 1180,
    "firmware_version": 46,
    "operating_mode": 3,
    "velocity_limit": 304,
    "present_input_voltage": 120,
    "present_temperature": 25,
}

TICK_S = 0.05
"""Time after which the server lets the motor's own clock act, even if no bytes came."""


class Instruction(IntEnum):
    """The instruction of a packet, or `STATUS` for an answer."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    STATUS = 0x55


class ErrorNumber(IntEnum):
    """Bits 0 to 6 of a status packet's error byte."""

    NONE = 0
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LIMIT = 6
    ACCESS = 7


class BusPacket(NamedTuple):
    """A packet without its stuffing. `intact` is False when its CRC did not match: only `id` may then be used."""

    id: int
    instruction: int
    params: bytes = b""
    intact: bool = True


def crc16(data: bytes) -> int:
    """Compute the CRC-16 with polynomial 0x8005, start 0, not reflected, of the stuffed packet from its header on."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (0x18005 if crc & 0x8000 else 0)
    return crc


def encode(packet: BusPacket) -> bytes:
    """Encode a packet for the line: stuffed, with length and CRC."""
    body = (bytes([packet.instruction]) + packet.params).replace(PLAIN, STUFFED)
    head = HEADER + bytes([packet.id]) + (len(body) + 2).to_bytes(2, "little")
    return head + body + crc16(head + body).to_bytes(2, "little")


class PacketReader:
    """A finder of packets in a stream of bytes that may hold anything else as well.

    Stuffing keeps the header out of every packet, so that one that is cut short costs itself alone.
    """

    def __init__(self) -> None:
        self._buffer = b""

    def push(self, data: bytes) -> list[BusPacket]:
        """Return the packets completed by these bytes, in order."""
        packets = []
        self._buffer, *parts = (self._buffer + data).split(HEADER)
        for part in parts:
            end = 3 + int.from_bytes(part[1:3], "little")
            whole = 6 <= end <= len(part)
            if whole:
                packets.append(_decode(HEADER + part[:end]))
            self._buffer = part[end:] if whole else HEADER + part
        return packets


def _decode(raw: bytes) -> BusPacket:
    body = raw[7:-2].replace(STUFFED, PLAIN)
    return BusPacket(raw[4], body[0], body[1:], intact=crc16(raw[:-2]) == int.from_bytes(raw[-2:], "little"))


# The motor.


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


class MotorEmulator:
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
        """Return whether it is not being driven: torque off, or held at a speed of zero."""
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

    def _hear(self, packet: BusPacket) -> bytes:
        if packet.intact:
            self._heard_at = self._now
        if packet.id not in (self.id, BROADCAST_ID):
            return b""
        number, params = self._obey(packet)
        alert = ALERT if self._get("hardware_error_status") else 0
        return encode(BusPacket(self.id, Instruction.STATUS, bytes([alert | number]) + params))

    def _obey(self, packet: BusPacket) -> tuple[ErrorNumber, bytes]:
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


@contextmanager
def pseudo_terminal(motor: MotorEmulator, baud: int) -> Iterator[str]:
    """Serve a motor in real time while its `with` block lasts, or until it is no longer `connected`.

    Yields the path that a client opens. A motor hears nothing at another speed than `baud`.
    """
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    server = threading.Thread(target=_serve, args=(motor, baud, master, slave), name="emulated motor", daemon=True)
    server.start()
    try:
        yield os.ttyname(slave)
    finally:
        motor.connected = False
        server.join()


def run_emulator(motor: MotorEmulator, baud: int, report: Callable[[str], None]) -> None:
    """Serve an emulated motor on a pseudo-terminal until Ctrl-C or SIGTERM.

    The first line reported is the terminal's path alone, so that a program can read it; at the end it reports how the
    motor was left.

    Args:
        motor: the emulated motor.
        baud: the only baud rate at which it hears anything.
        report: receives lines for the user.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with pseudo_terminal(motor, baud) as path:
        try:
            report(path)
            report(f"An emulated XW540-T140-R, id {motor.id}, at {baud} baud. Ctrl-C ends it.")
            threading.Event().wait()
        except KeyboardInterrupt:
            report("")
    report(f"Ended. The motor is {'not driven' if motor.stopped else 'STILL DRIVEN'}.")


def _serve(motor: MotorEmulator, baud: int, master: int, slave: int) -> None:
    speed = getattr(termios, f"B{baud}", baud)
    while motor.connected:
        ready, _, _ = select.select([master], [], [], TICK_S)
        data = os.read(master, 4096) if ready else b""
        reply = motor.feed(data if termios.tcgetattr(slave)[5] == speed else b"")
        if reply:
            time.sleep(motor.reply_delay_s)
            with suppress(BlockingIOError):  # answers to a client that never reads are lost
                os.write(master, reply)
    os.close(slave)
    os.close(master)
