"""The XW540-T140-R's control table: what can be read and written where.

Source: ROBOTIS e-manual, "XW540-T140-R", control tables of the EEPROM and the RAM area (addresses, sizes, access,
initial values, ranges). It has what `calib capture` reads and writes, and what bears on that; reading or writing
elsewhere (gains, homing, indirect addresses, the backup) is an access error.
"""

from typing import NamedTuple

from calib.motor.protocol import ErrorNumber

MODEL_NUMBER = 1180
EEPROM_END = 64
SIZE = 147


class Item(NamedTuple):
    """One entry: little-endian, two's complement where `low` is negative; from the bus `low` to `high` are allowed."""

    name: str
    address: int
    size: int
    initial: int = 0
    low: int = 0
    high: int = 0
    writable: bool = True


def _read_only(name: str, address: int, size: int, initial: int = 0, signed: bool = False) -> Item:
    return Item(name, address, size, initial, low=-1 if signed else 0, writable=False)


ITEMS = (
    _read_only("model_number", 0, 2, MODEL_NUMBER),
    _read_only("firmware_version", 6, 1, 46),
    Item("id", 7, 1, 1, 0, 252),
    Item("baud_rate", 8, 1, 1, 0, 7),
    Item("return_delay_time", 9, 1, 250, 0, 254),
    Item("drive_mode", 10, 1, 0, 0, 5),
    Item("operating_mode", 11, 1, 3, 0, 16),
    _read_only("secondary_id_and_protocol", 12, 2, 0x02FF),
    Item("velocity_limit", 44, 4, 304, 0, 1_023),
    _read_only("position_limits", 48, 8, 4_095),
    Item("torque_enable", 64, 1, 0, 0, 1),
    _read_only("registered_instruction", 69, 1),
    _read_only("hardware_error_status", 70, 1),
    Item("bus_watchdog", 98, 1, 0, -1, 127),
    _read_only("goal_pwm_and_current", 100, 4),
    Item("goal_velocity", 104, 4, 0, -1_023, 1_023),
    Item("profile_acceleration", 108, 4, 0, 0, 32_767),
    Item("profile_velocity", 112, 4, 0, 0, 32_767),
    _read_only("realtime_tick", 120, 2),
    _read_only("moving_and_pwm", 122, 4),
    _read_only("present_current", 126, 2, signed=True),
    _read_only("present_velocity", 128, 4, signed=True),
    _read_only("present_position", 132, 4, signed=True),
    _read_only("trajectories", 136, 8),
    _read_only("present_input_voltage", 144, 2),
    _read_only("present_temperature", 146, 1),
)
"""Neighbours that are only read together count as one."""
BY_NAME = {item.name: item for item in ITEMS}
BY_ADDRESS = {item.address: item for item in ITEMS}
DEFINED = frozenset(address for item in ITEMS for address in range(item.address, item.address + item.size))


class Refusal(Exception):
    """A read or write the control table does not allow; `number` goes into the status packet's error byte."""

    def __init__(self, number: ErrorNumber) -> None:
        super().__init__(number.name)
        self.number = number


class ControlTable:
    """The entries' present values as bytes: by name from inside the motor, by address and under rules from the bus."""

    def __init__(self) -> None:
        self._memory = bytearray(SIZE)
        self._reset(since=0)

    def restart(self) -> None:
        """What a loss of power does: the RAM area goes back to its initial values."""
        self._reset(since=EEPROM_END)

    def _reset(self, since: int) -> None:
        for item in ITEMS:
            if item.address >= since:
                self[item.name] = item.initial

    def __getitem__(self, name: str) -> int:
        item = BY_NAME[name]
        raw = self._memory[item.address : item.address + item.size]
        return int.from_bytes(raw, "little", signed=item.low < 0)

    def __setitem__(self, name: str, value: int) -> None:
        item = BY_NAME[name]
        raw = (value & ((1 << 8 * item.size) - 1)).to_bytes(item.size, "little")
        self._memory[item.address : item.address + item.size] = raw

    def read(self, address: int, length: int) -> bytes:
        """The bytes at an address, as the bus reads them.

        Raises:
            Refusal: ACCESS where a byte belongs to no entry, DATA_LENGTH for no bytes at all.
        """
        if length == 0:
            raise Refusal(ErrorNumber.DATA_LENGTH)
        if address + length > SIZE or any(at not in DEFINED for at in range(address, address + length)):
            raise Refusal(ErrorNumber.ACCESS)
        return bytes(self._memory[address : address + length])

    def check_write(self, address: int, data: bytes) -> dict[str, int]:
        """What a write from the bus would change: {entry: value}. Nothing is changed yet: a write counts whole.

        Raises:
            Refusal: ACCESS for an entry that is read-only, undefined, or in EEPROM while torque is on; DATA_LENGTH
                for part of an entry; DATA_RANGE for values out of bounds, and for goals after the bus watchdog has
                tripped; DATA_LIMIT beyond the velocity limit.
        """
        if not data:
            raise Refusal(ErrorNumber.DATA_LENGTH)
        values: dict[str, int] = {}
        at, end = address, address + len(data)
        while at < end:
            item = self._writable_at(at)
            if at + item.size > end:
                raise Refusal(ErrorNumber.DATA_LENGTH)
            raw = data[at - address : at - address + item.size]
            values[item.name] = int.from_bytes(raw, "little", signed=item.low < 0)
            at += item.size
        for name, value in values.items():
            self._check_value(BY_NAME[name], value)
        return values

    def _writable_at(self, address: int) -> Item:
        if address not in DEFINED:
            raise Refusal(ErrorNumber.ACCESS)
        item = BY_ADDRESS.get(address)
        if item is None:
            raise Refusal(ErrorNumber.DATA_LENGTH)
        if not item.writable or (address < EEPROM_END and self["torque_enable"]):
            raise Refusal(ErrorNumber.ACCESS)
        return item

    def _check_value(self, item: Item, value: int) -> None:
        tripped = self["bus_watchdog"] < 0
        allowed = item.low <= value <= item.high
        if item.name == "bus_watchdog":
            allowed = value == 0 if tripped else value >= 0
        if not allowed or (tripped and item.name == "goal_velocity"):
            raise Refusal(ErrorNumber.DATA_RANGE)
        if item.name == "goal_velocity" and abs(value) > self["velocity_limit"]:
            raise Refusal(ErrorNumber.DATA_LIMIT)
