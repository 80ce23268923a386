from __future__ import annotations

import random
import termios

import dynamixel_sdk as sdk
import pytest

from calib.motor import HardwareError
from tests.calib.motor.faults import ALL_FAULTS, Fault, Faults, FaultyEmulator
from tests.calib.motor.virtual_port import VirtualClock, VirtualPort

PACKETS = sdk.Protocol2PacketHandler()


def faulty(kind: Fault, rate: float = 1.0, after: int = 0) -> tuple[FaultyEmulator, VirtualPort]:
    motor = FaultyEmulator(Faults(seed=1, kinds=(kind,), rate=rate, after=after), clock=VirtualClock())
    port = VirtualPort(motor)
    assert port.openPort()
    return motor, port


@pytest.mark.parametrize(
    ("kind", "result"),
    [
        (Fault.REQUEST_LOST, {sdk.COMM_RX_TIMEOUT}),
        (Fault.REPLY_LOST, {sdk.COMM_RX_TIMEOUT}),
        (Fault.REPLY_CORRUPTED, {sdk.COMM_RX_TIMEOUT, sdk.COMM_RX_CORRUPT}),
        (Fault.REPLY_CUT, {sdk.COMM_RX_TIMEOUT, sdk.COMM_RX_CORRUPT}),
        (Fault.WRONG_BAUD, {sdk.COMM_RX_TIMEOUT, sdk.COMM_RX_CORRUPT}),
    ],
)
def test_the_sdk_sees_the_fault(kind: Fault, result: set[int]) -> None:
    _, port = faulty(kind)

    for _ in range(20):
        assert PACKETS.ping(port, 1)[1] in result


def test_a_late_reply_turns_up_in_a_later_exchange() -> None:
    _, port = faulty(Fault.REPLY_LATE, rate=0.5)
    PACKETS.write1ByteTxRx(port, 1, 64, 1)
    odd = 0

    for _ in range(100):
        data, result, _ = PACKETS.readTxRx(port, 1, 120, 27)
        odd += result == sdk.COMM_SUCCESS and len(data) != 27
        PACKETS.ping(port, 1)
    assert odd > 0


def test_a_lost_cable_raises_what_pyserial_and_the_terminal_raise() -> None:
    motor, port = faulty(Fault.DISCONNECT, after=1)
    assert PACKETS.ping(port, 1)[1] == sdk.COMM_SUCCESS

    with pytest.raises(OSError, match="no data"):
        PACKETS.ping(port, 1)
    assert not motor.connected
    assert port.is_using  # the SDK's known fault: nothing more is sent until it is reset
    assert PACKETS.ping(port, 1)[1] == sdk.COMM_PORT_BUSY
    port.is_using = False
    with pytest.raises(termios.error, match="Input/output"):
        PACKETS.ping(port, 1)
    with pytest.raises(OSError, match="the cable is lost"):
        port.openPort()


def test_a_motor_on_a_lost_cable_goes_on_until_its_watchdog_trips() -> None:
    motor = FaultyEmulator(Faults(kinds=(Fault.DISCONNECT,), rate=1.0, after=4), clock=VirtualClock())
    port = VirtualPort(motor)
    port.openPort()
    for address, size, value in ((11, 1, 1), (98, 1, 10), (64, 1, 1), (104, 4, 200)):
        assert PACKETS.writeTxRx(port, 1, address, size, list(value.to_bytes(size, "little"))) == (0, 0)
    with pytest.raises(OSError, match="no data"):
        PACKETS.ping(port, 1)

    assert not motor.stopped
    port.clock.sleep(0.3)
    assert motor.stopped


@pytest.mark.parametrize("error", list(HardwareError))
def test_a_hardware_error_shows_in_the_alert_bit(error: HardwareError) -> None:
    motor, port = faulty(Fault[str(error.name)])

    assert PACKETS.ping(port, 1)[2] == 0x80
    assert motor.state.hardware_error == error


def test_a_power_cycle_silences_it_and_then_it_knows_nothing() -> None:
    motor, port = faulty(Fault.POWER_CYCLE, rate=0.5)
    while not motor.happened:
        PACKETS.write1ByteTxRx(port, 1, 64, 1)

    assert not motor.state.torque_enabled
    assert PACKETS.ping(port, 1)[1] == sdk.COMM_RX_TIMEOUT


def test_the_same_seed_gives_the_same_faults_and_another_seed_others() -> None:
    def happened(seed: int) -> list[tuple[int, Fault]]:
        kinds = tuple(kind for kind in ALL_FAULTS if kind is not Fault.DISCONNECT)
        motor = FaultyEmulator(Faults(seed, kinds, rate=0.3), clock=VirtualClock())
        port = VirtualPort(motor)
        port.openPort()
        for _ in range(30):
            PACKETS.ping(port, 1)
        return motor.happened

    assert happened(1) == happened(1) != happened(2)


def test_the_sdk_comes_through_any_faults_and_the_watchdog_stops_the_motor() -> None:
    for seed in range(200):
        motor = FaultyEmulator(Faults(seed, rate=0.1), clock=VirtualClock(), seed=seed)
        port = VirtualPort(motor)
        port.openPort()
        rng = random.Random(seed)
        for _ in range(40):
            address, size, value = rng.choice([(11, 1, 1), (98, 1, 10), (64, 1, 1), (104, 4, 200)])
            try:
                PACKETS.writeTxRx(port, 1, address, size, list(value.to_bytes(size, "little")))
                PACKETS.readTxRx(port, 1, 120, 27)
            except (OSError, termios.error, IndexError):
                port.is_using = False
        watched = motor.table["bus_watchdog"] != 0
        port.clock.sleep(1.0)
        assert motor.stopped or not watched, (seed, motor.happened)
