import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib.capture import registers
from calib.capture.registers import MEASURED, Telemetry, TurnCounter, decode_measured


def block(value: Telemetry) -> bytes:
    data = bytearray(MEASURED.size)
    for name, address, size in (
        ("tick", 120, 2),
        ("current", 126, 2),
        ("velocity", 128, 4),
        ("position", 132, 4),
        ("voltage", 144, 2),
        ("temperature", 146, 1),
    ):
        start = address - MEASURED.address
        data[start : start + size] = (getattr(value, name) % 256**size).to_bytes(size, "little")
    return bytes(data)


@given(
    st.builds(
        Telemetry,
        tick=st.integers(0, 32767),
        current=st.integers(-2048, 2047),
        velocity=st.integers(-1023, 1023),
        position=st.integers(-(2**31), 2**31 - 1),
        voltage=st.integers(0, 200),
        temperature=st.integers(0, 120),
    )
)
def test_values_come_back_signed(value: Telemetry) -> None:
    assert decode_measured(block(value)) == value


@pytest.mark.parametrize("modulus", [32768, 2**32])
@given(steps=st.lists(st.integers(-16383, 16383), min_size=1), start=st.integers(0, 32767))
def test_counters_go_on_over_their_wraps(modulus: int, steps: list[int], start: int) -> None:
    counter, total = TurnCounter(modulus), start
    counter.follow(start)
    for step in steps:
        total += step
        assert counter.follow(total % modulus) == total


def test_units_are_those_of_the_manual() -> None:
    assert registers.velocity_units(72 / 60) == round(72 / 0.229)
    assert math.isclose(registers.rad_per_s(1000), 229 * 2 * math.pi / 60)
    assert math.isclose(registers.reach_turns_per_s(12.0), 1.2)
    assert registers.acceleration_units(214.577 / 3600 * 5) == 5
    assert registers.acceleration_units(0.0) == 1  # 0 would mean: no limit
