from __future__ import annotations

import pytest

from calib.capture.emulator import (
    ALERT,
    ITEMS,
    BusPacket,
    ErrorNumber,
    Instruction,
    MotorEmulator,
    PacketReader,
    encode,
)
from tests.calib.motor.virtual_port import VirtualClock


class Host:
    """Asks an emulated motor in bytes; error byte and parameters of its answer, or None for silence."""

    def __init__(self, load_nm: float = 0.0) -> None:
        self.clock = VirtualClock()
        self.motor = MotorEmulator(clock=self.clock, load_nm=load_nm)

    def ask(self, instruction: int, params: bytes = b"", to: int = 1) -> tuple[int, bytes] | None:
        answers = PacketReader().push(self.motor.feed(encode(BusPacket(to, instruction, params))))
        if not answers:
            return None
        (answer,) = answers
        assert (answer.intact, answer.instruction) == (True, Instruction.STATUS)
        return answer.params[0], answer.params[1:]

    def write(self, name: str, value: int) -> int:
        item = ITEMS[name]
        data = (value % 256**item.size).to_bytes(item.size, "little")
        answer = self.ask(Instruction.WRITE, item.address.to_bytes(2, "little") + data)
        assert answer is not None
        return answer[0]

    def turn(self, goal: int, acceleration: int = 0, watchdog: int = 0) -> None:
        """Velocity mode, torque on, off it goes."""
        settings = {"operating_mode": 1, "torque_enable": 1, "profile_acceleration": acceleration}
        for name, value in {**settings, "bus_watchdog": watchdog, "goal_velocity": goal}.items():
            assert self.write(name, value) == 0


@pytest.fixture
def host() -> Host:
    return Host()


def test_a_ping_is_answered_with_model_and_firmware(host: Host) -> None:
    answer = host.ask(Instruction.PING)

    assert answer == (0, (1180).to_bytes(2, "little") + b"\x2e")
    assert host.ask(Instruction.PING, to=0xFE) == answer
    assert host.ask(Instruction.PING, to=2) is None
    assert host.ask(0x92, b"\x01") == (ErrorNumber.INSTRUCTION, b"")


def test_it_ramps_as_its_profile_says_and_turns_at_the_speed_asked_for(host: Host) -> None:
    host.turn(-200, acceleration=5)
    before = host.motor["present_position"]

    host.clock.sleep(2.0)
    assert host.motor["present_velocity"] == -round(5 * 214.577 / 60 * 2.0 / 0.229)
    host.clock.sleep(2.0)
    assert host.motor["present_velocity"] == -200
    ramp_s = 200 * 0.229 * 60 / (5 * 214.577)
    turned = 200 * 0.229 / 60 * 4096 * (4.0 - ramp_s / 2)
    assert before - host.motor["present_position"] == pytest.approx(turned, abs=1.01)
    assert not host.motor.stopped


@pytest.mark.parametrize(("load_nm", "share"), [(0.0, 0.0), (2.0, 2.0 / 6.9), (9.0, 1.0)])
def test_a_load_takes_speed_and_current_along_their_line(load_nm: float, share: float) -> None:
    host = Host(load_nm)
    host.turn(304)
    host.clock.sleep(1.0)

    assert host.motor["present_velocity"] == pytest.approx(min(304, (1 - share) * 72 / 0.229), abs=1)
    assert host.motor["present_current"] == round(share * 4.9 / 2.69e-3)


def test_the_tick_counts_milliseconds_and_wraps(host: Host) -> None:
    before = host.motor["realtime_tick"]
    for step in range(1, 80):
        host.clock.sleep(1.234)
        assert host.motor["realtime_tick"] == pytest.approx((before + 1234 * step) % 32_768, abs=1)


def test_the_watchdog_stops_it_at_once_after_its_time_without_an_instruction(host: Host) -> None:
    host.turn(200, acceleration=100, watchdog=25)  # 0.5 s
    for _ in range(20):
        host.clock.sleep(0.499)
        host.ask(Instruction.PING, to=7)
    assert host.motor["present_velocity"] == 200

    host.clock.sleep(0.25)
    host.motor.feed(b"\xff\xff\xfd\x00 not a packet")
    host.clock.sleep(0.27)

    assert host.motor.stopped
    assert (host.motor["present_velocity"], host.motor["torque_enable"], host.motor["bus_watchdog"]) == (0, 1, -1)
    assert host.write("goal_velocity", 200) == ErrorNumber.DATA_RANGE
    assert host.write("bus_watchdog", 0) == host.write("goal_velocity", 200) == 0


def test_a_hardware_error_is_in_every_answer(host: Host) -> None:
    host.motor["hardware_error_status"] = 1

    assert host.write("goal_velocity", 100) == ALERT
    assert host.write("goal_velocity", 305) == ALERT | ErrorNumber.DATA_LIMIT


def test_what_may_not_be_written_is_refused(host: Host) -> None:
    assert host.write("goal_velocity", 305) == ErrorNumber.DATA_LIMIT
    assert host.write("present_velocity", 1) == ErrorNumber.ACCESS
    host.turn(200)
    assert host.write("operating_mode", 3) == ErrorNumber.ACCESS  # EEPROM, with the torque on


def test_a_read_gives_what_the_entries_hold_side_by_side(host: Host) -> None:
    host.turn(-200)
    answer = host.ask(Instruction.READ, b"\x68\x00\x08\x00")

    assert answer == (0, (-200).to_bytes(4, "little", signed=True) + bytes(4))
