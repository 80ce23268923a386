"""ROBOTIS' SDK at the other end, in virtual time."""

from __future__ import annotations

import inspect

import dynamixel_sdk as sdk
import pytest

from calib.motor import Emulator, VirtualClock, VirtualPort

PACKETS = sdk.Protocol2PacketHandler()


def open_port(**how: float) -> VirtualPort:
    port = VirtualPort(Emulator(clock=VirtualClock()), **how)
    assert port.openPort()
    return port


def test_it_has_all_that_the_sdks_port_has() -> None:
    theirs, ours = sdk.PortHandler("nowhere"), open_port()
    hidden = {"ser", "setupPort", "getCFlagBaud"}  # of pyserial

    for name in {name for name in dir(theirs) if not name.startswith("_")} - hidden:
        assert hasattr(ours, name), name
        if callable(getattr(theirs, name)):
            wanted = inspect.signature(getattr(theirs, name)).parameters
            assert list(inspect.signature(getattr(ours, name)).parameters) == list(wanted), name


def test_the_sdk_finds_and_identifies_the_motor() -> None:
    port = open_port()

    assert PACKETS.ping(port, 1) == (1180, sdk.COMM_SUCCESS, 0)
    assert PACKETS.broadcastPing(port) == ({1: [1180, 46]}, sdk.COMM_SUCCESS)


def test_the_sdk_turns_the_motor_and_reads_it_back() -> None:
    port = open_port()
    for address, size, value in ((11, 1, 1), (64, 1, 1), (108, 4, 20), (104, 4, -200 & 0xFFFFFFFF)):
        write = {1: PACKETS.write1ByteTxRx, 4: PACKETS.write4ByteTxRx}[size]
        assert write(port, 1, address, value) == (sdk.COMM_SUCCESS, 0)
    port.clock.sleep(3.0)

    data, result, error = PACKETS.readTxRx(port, 1, 120, 27)

    assert (result, error) == (sdk.COMM_SUCCESS, 0)
    assert int.from_bytes(bytes(data[8:12]), "little", signed=True) == -200
    assert int.from_bytes(bytes(data[24:26]), "little") == 120
    assert PACKETS.write1ByteTxRx(port, 1, 11, 3) == (sdk.COMM_SUCCESS, 7)


@pytest.mark.parametrize("latency_s", [1e-3, 16e-3])
def test_a_read_takes_its_bytes_the_motors_delay_and_the_adapters_latency(latency_s: float) -> None:
    port = open_port(latency_s=latency_s)
    before = port.clock()

    PACKETS.readTxRx(port, 1, 120, 27)

    assert port.clock() - before == pytest.approx((14 + 27 + 11) * 10 / 1e6 + 250 * 2e-6 + latency_s, abs=1e-4)


def test_at_the_wrong_rate_nothing_is_found_and_an_unknown_one_is_refused() -> None:
    port = open_port()

    assert port.setBaudRate(57_600)
    assert PACKETS.ping(port, 1)[1] != sdk.COMM_SUCCESS
    assert not port.setBaudRate(12_345)
    assert port.setBaudRate(1_000_000)
    assert PACKETS.ping(port, 1)[1] == sdk.COMM_SUCCESS


def test_it_wants_a_virtual_clock() -> None:
    with pytest.raises(TypeError, match="needs a motor with a VirtualClock"):
        VirtualPort(Emulator())
