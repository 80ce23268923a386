from __future__ import annotations

import math
import random

import pytest

from calib.motor import Emulator, HardwareError
from calib.motor.protocol import HEADER, ErrorNumber, Instruction, Packet, encode
from tests.calib.motor.faults import power_cycle
from tests.calib.motor.host import (
    BUS_WATCHDOG,
    GOAL_VELOCITY,
    OPERATING_MODE,
    TORQUE_ENABLE,
    Host,
)
from tests.calib.motor.virtual_port import VirtualClock

ALERT = 0x80


@pytest.fixture
def host() -> Host:
    return Host()


def test_a_ping_is_answered_with_model_and_firmware(host: Host) -> None:
    answer = host.ask(Instruction.PING)

    assert answer is not None
    assert answer == (0, (1180).to_bytes(2, "little") + b"\x2e")
    assert host.ask(Instruction.PING, to=0xFE) == answer
    assert host.ask(Instruction.PING, to=2) is None


def test_it_turns_at_the_speed_asked_for(host: Host) -> None:
    host.turn(-250)
    host.clock.sleep(1.0)
    before = host.read(132, 4, signed=True)
    host.clock.sleep(2.0)

    assert host.read(128, 4, signed=True) == -250
    assert host.read(132, 4, signed=True) - before == pytest.approx(-250 * 0.229 / 60 * 4096 * 2.0, abs=1.01)
    assert not host.motor.stopped


def test_the_ramp_has_the_acceleration_of_the_profile(host: Host) -> None:
    host.turn(200, acceleration=5)
    host.clock.sleep(2.0)

    assert host.read(128, 4) == round(5 * 214.577 / 60 * 2.0 / 0.229)
    host.clock.sleep(2.0)
    assert host.read(128, 4) == 200


def test_the_tick_counts_milliseconds_and_wraps(host: Host) -> None:
    before = host.read(120, 2)
    host.clock.sleep(1.234)
    assert (host.read(120, 2) - before) % 32_768 == pytest.approx(1234, abs=1)
    for step in range(1, 80):
        host.clock.sleep(1.0)
        assert host.read(120, 2) == pytest.approx((before + 1234 + 1000 * step) % 32_768, abs=1)


class TestBusWatchdog:
    def test_it_trips_after_its_time_without_an_instruction_and_not_before(self, host: Host) -> None:
        host.turn(200)
        host.write(BUS_WATCHDOG, 25)  # 0.5 s

        host.clock.sleep(0.499)
        assert not host.motor.stopped
        host.clock.sleep(0.002)
        assert host.motor.stopped

        state = host.motor.state
        assert state.torque_enabled
        assert state.watchdog_tripped
        assert host.read(BUS_WATCHDOG, 1, signed=True) == -1
        assert host.read(GOAL_VELOCITY, 4) == 0

    def test_it_stops_at_once_whatever_the_profile(self, host: Host) -> None:
        host.turn(200, acceleration=1)
        host.write(BUS_WATCHDOG, 1)
        for _ in range(200):
            host.clock.sleep(0.019)
            host.read(120, 2)
        assert host.motor.state.velocity_rad_s > 0.2

        host.clock.sleep(0.07)

        assert host.motor.state.velocity_rad_s == 0.0

    def test_any_instruction_keeps_it_quiet_and_noise_does_not(self, host: Host) -> None:
        host.turn(200)
        host.write(BUS_WATCHDOG, 5)
        for _ in range(20):
            host.clock.sleep(0.09)
            host.ask(Instruction.PING, to=7)
        assert not host.motor.stopped

        for _ in range(20):
            host.clock.sleep(0.09)
            host.motor.feed(b"\xff\xff\xfd\x00 not a packet")
        assert host.motor.stopped


class TestHardwareErrors:
    @pytest.mark.parametrize(
        "error", [HardwareError.OVERLOAD, HardwareError.OVERHEATING, HardwareError.ELECTRICAL_SHOCK]
    )
    def test_those_named_in_shutdown_switch_torque_off_until_it_restarts(
        self, host: Host, error: HardwareError
    ) -> None:
        host.turn(200)
        host.motor.raise_error(error)

        assert host.motor.stopped
        assert host.read(70, 1) == error
        assert host.read(TORQUE_ENABLE, 1) == 0
        assert host.write(TORQUE_ENABLE, 1) == ALERT | ErrorNumber.RESULT_FAIL

        power_cycle(host.motor)
        host.clock.sleep(1.0)
        assert host.read(70, 1) == 0
        assert host.write(TORQUE_ENABLE, 1) == 0

    def test_a_motor_worked_too_hard_overheats(self) -> None:
        clock = VirtualClock()
        host = Host(Emulator(clock=clock, load_nm=5.0))
        host.turn(50)

        clock.sleep(600.0)

        assert host.motor.state.hardware_error == HardwareError.OVERHEATING
        assert host.motor.stopped

    def test_a_stalled_motor_overloads_after_a_second(self) -> None:
        clock = VirtualClock()
        host = Host(Emulator(clock=clock, load_nm=8.0))
        host.turn(200)

        clock.sleep(0.9)
        assert not host.motor.stopped
        assert host.read(126, 2, signed=True) == pytest.approx(4.9 / 2.69e-3, abs=5)
        clock.sleep(0.3)
        assert host.motor.stopped
        assert host.motor.state.hardware_error == HardwareError.OVERLOAD


def test_what_is_sent_to_all_is_obeyed_in_silence(host: Host) -> None:
    assert host.ask(Instruction.WRITE, b"\x40\x00\x01", to=0xFE) is None
    assert host.motor.state.torque_enabled


def test_what_it_does_not_know_is_refused(host: Host) -> None:
    assert host.ask(0x92, b"\x01") == (ErrorNumber.INSTRUCTION, b"")


def test_a_loss_of_power_forgets_ram_and_whole_turns_and_takes_its_time(host: Host) -> None:
    host.turn(200)
    host.write(BUS_WATCHDOG, 100)
    host.clock.sleep(1.9)
    host.write(GOAL_VELOCITY, 200)
    host.clock.sleep(1.9)
    power_cycle(host.motor)

    assert host.ask(Instruction.PING) is None
    host.clock.sleep(1.0)
    assert host.ask(Instruction.PING) is not None
    assert (host.read(BUS_WATCHDOG, 1), host.read(GOAL_VELOCITY, 4), host.read(TORQUE_ENABLE, 1)) == (0, 0, 0)
    assert host.read(OPERATING_MODE, 1) == 1
    assert host.motor.state.position_rad < 2 * math.pi + 1.0


def test_at_another_baud_rate_neither_understands_the_other(host: Host) -> None:
    ping = encode(Packet(1, Instruction.PING))

    assert host.motor.feed(ping, 57_600) == b""
    assert host.motor.feed(ping, 1_000_000) != b""
    assert host.write(8, 1, size=1) == 0
    assert host.motor.baud == 57_600
    assert host.motor.feed(ping, 57_600) != b""


def test_random_bytes_never_break_it() -> None:
    instructions = [*Instruction, 0x00, 0x20, 0x8A, 0xFF]
    for seed in range(400):
        rng = random.Random(seed)
        host = Host()
        for _ in range(rng.randint(1, 30)):
            choice = rng.random()
            params = rng.randbytes(rng.choice([0, 1, 2, 3, 4, 5, 6, 8, 20]))
            if choice < 0.5 and len(params) >= 2:  # towards entries that exist
                params = rng.randrange(150).to_bytes(2, "little") + params[2:]
            sent = encode(Packet(rng.choice([1, 1, 1, 0xFE, 2]), rng.choice(instructions), params))
            if choice > 0.8:
                sent = (
                    rng.randbytes(rng.randint(0, 60)) + (HEADER if choice > 0.9 else b"") + sent[: rng.randint(0, 12)]
                )
            host.motor.feed(sent, rng.choice([None, None, None, 57_600]))
            host.clock.sleep(rng.choice([0.0, 0.01, 0.5, 3.0]))
        assert math.isfinite(host.motor.state.position_rad)
        power_cycle(host.motor)
        host.clock.sleep(1.0)
        assert host.motor.feed(encode(Packet(host.motor.table["id"], Instruction.PING)))
        assert host.motor.stopped
