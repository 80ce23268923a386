from __future__ import annotations

import pytest

from calib.motor.control_table import BY_NAME, ITEMS, ControlTable, Refusal
from calib.motor.protocol import ErrorNumber

ACCESS, RANGE, LENGTH, LIMIT = (
    ErrorNumber.ACCESS,
    ErrorNumber.DATA_RANGE,
    ErrorNumber.DATA_LENGTH,
    ErrorNumber.DATA_LIMIT,
)


def entry(name: str, value: int) -> tuple[int, bytes]:
    item = BY_NAME[name]
    return item.address, (value & (1 << 8 * item.size) - 1).to_bytes(item.size, "little")


def refusal(table: ControlTable, address: int, data: bytes) -> ErrorNumber | None:
    try:
        table.check_write(address, data)
    except Refusal as refused:
        return refused.number
    return None


def test_entries_do_not_overlap() -> None:
    taken = [address for item in ITEMS for address in range(item.address, item.address + item.size)]
    assert len(taken) == len(set(taken))


@pytest.mark.parametrize(("address", "length"), [(14, 1), (63, 3), (140, 20), (168, 2), (5000, 1)])
def test_reading_where_nothing_is_defined_is_an_access_error(address: int, length: int) -> None:
    with pytest.raises(Refusal) as refused:
        ControlTable().read(address, length)
    assert refused.value.number is ACCESS


@pytest.mark.parametrize(
    ("name", "value", "number"),
    [
        ("operating_mode", 1, None),
        ("operating_mode", 17, RANGE),
        ("return_delay_time", 254, None),
        ("return_delay_time", 255, RANGE),
        ("bus_watchdog", 127, None),
        ("bus_watchdog", 128, RANGE),
        ("bus_watchdog", -1, RANGE),
        ("torque_enable", 2, RANGE),
        ("profile_acceleration", -1, RANGE),
        ("goal_velocity", -304, None),
        ("goal_velocity", 305, LIMIT),
        ("goal_velocity", 1024, RANGE),
        ("model_number", 1, ACCESS),
        ("hardware_error_status", 0, ACCESS),
        ("present_velocity", 1, ACCESS),
    ],
)
def test_a_write_is_held_to_access_range_and_limit(name: str, value: int, number: ErrorNumber | None) -> None:
    assert refusal(ControlTable(), *entry(name, value)) is number


def test_eeprom_is_closed_while_torque_is_on() -> None:
    table = ControlTable()
    table["torque_enable"] = 1

    for item in ITEMS:
        number = refusal(table, *entry(item.name, item.initial))
        assert number is (ACCESS if item.address < 64 or not item.writable else None), item.name


@pytest.mark.parametrize(("address", "data"), [(104, b"\x01\x00"), (105, b"\x01"), (104, b"")])
def test_part_of_an_entry_is_a_length_error(address: int, data: bytes) -> None:
    assert refusal(ControlTable(), address, data) is LENGTH


def test_entries_side_by_side_are_written_at_once_or_not_at_all() -> None:
    table = ControlTable()
    speed, acceleration = (200).to_bytes(4, "little"), (30).to_bytes(4, "little")

    assert table.check_write(104, speed + acceleration) == {"goal_velocity": 200, "profile_acceleration": 30}
    assert refusal(table, 104, speed + b"\xff" * 4) is RANGE
    assert table["goal_velocity"] == 0


def test_a_tripped_watchdog_closes_the_goals_until_zero_is_written() -> None:
    table = ControlTable()
    table["bus_watchdog"] = -1

    assert refusal(table, *entry("goal_velocity", 0)) is RANGE
    assert refusal(table, *entry("bus_watchdog", 5)) is RANGE
    assert refusal(table, *entry("bus_watchdog", 0)) is None
    assert refusal(table, *entry("torque_enable", 0)) is None
