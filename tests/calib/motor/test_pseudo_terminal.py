"""ROBOTIS' SDK and pyserial at the other end of a true pseudo-terminal, in real time."""

from __future__ import annotations

import time

import dynamixel_sdk as sdk
import pytest

from calib.motor import Emulator, PseudoTerminal
from tests.calib.motor.faults import Fault, Faults, FaultyEmulator
from tests.calib.motor.terminal import open_port

PACKETS = sdk.Protocol2PacketHandler()


def ping_without_end(port: sdk.PortHandler) -> None:
    while True:
        PACKETS.ping(port, 1)
        port.is_using = False


def test_the_sdk_drives_the_motor_through_it() -> None:
    motor = Emulator()
    with PseudoTerminal(motor, baud=1_000_000) as terminal:
        port = open_port(terminal.path)
        assert PACKETS.ping(port, 1) == (1180, sdk.COMM_SUCCESS, 0)
        for address, size, value in ((11, 1, 1), (64, 1, 1), (104, 4, 200)):
            assert PACKETS.writeTxRx(port, 1, address, size, list(value.to_bytes(size, "little"))) == (0, 0)
        time.sleep(0.1)
        data, result, error = PACKETS.readTxRx(port, 1, 120, 27)
        port.closePort()

    assert (result, error) == (sdk.COMM_SUCCESS, 0)
    assert int.from_bytes(bytes(data[8:12]), "little", signed=True) == 200
    assert not motor.stopped


def test_a_host_that_falls_silent_is_noticed_by_the_watchdog() -> None:
    motor = Emulator()
    with PseudoTerminal(motor) as terminal:
        port = open_port(terminal.path)
        for address, size, value in ((11, 1, 1), (64, 1, 1), (98, 1, 50), (104, 4, 200)):
            assert PACKETS.writeTxRx(port, 1, address, size, list(value.to_bytes(size, "little"))) == (0, 0)
        port.closePort()
        assert not motor.stopped
        time.sleep(1.1)

    assert motor.stopped
    assert motor.state.watchdog_tripped


def test_a_lost_cable_ends_the_terminal_under_its_client() -> None:
    device = FaultyEmulator(Faults(kinds=(Fault.DISCONNECT,), rate=1.0, after=1))
    with PseudoTerminal(device) as terminal:
        port = open_port(terminal.path)
        assert PACKETS.ping(port, 1)[1] == sdk.COMM_SUCCESS
        with pytest.raises(Exception, match=r"no data|Input/output"):
            ping_without_end(port)
        port.closePort()


def test_a_speed_that_is_not_the_motors_is_refused() -> None:
    with pytest.raises(ValueError, match="make them the same"):
        PseudoTerminal(Emulator(baud=57_600), baud=1_000_000)
