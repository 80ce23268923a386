"""The questions to one motor and its answers, over `dynamixel_sdk`, whose known faults are worked around here.

- After an exception in the middle of an answer, `port.is_using` stays True and every later packet, a torque-off among
  them, is silently not sent: it is reset before every packet.
- A packet that needs stuffing is sent unstuffed. None that is sent here does: see the tests.
- Values come back unsigned: they are decoded from the bytes.
- An answer that is longer or shorter than what was requested, such as a late one to an earlier question, is cut to the
  length requested, if need be with its checksum as data: the length of the packet is checked here. Blocks that are
  read therefore differ in length.
- It busy-waits for an answer: the port is given a time-out of its own.
"""

import contextlib
from typing import Any, NamedTuple

from dynamixel_sdk import COMM_RX_CORRUPT, COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler, PortHandler
from dynamixel_sdk.robotis_def import INST_PING, INST_READ, INST_WRITE

from calib.capture.errors import MotorFault, NoAnswer, UserError
from calib.capture.host import Clock
from calib.capture.registers import Register

try:
    from termios import error as TerminalError
except ImportError:  # Windows
    TerminalError = OSError  # type: ignore[misc, assignment]

BAUD_RATES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
"""Baud rates that both the motor and the SDK support."""

TRIES = 9  # each takes 34 ms with the SDK's time-outs, so that all fit into the watchdog's time
SETTLE_S = 0.01  # pause after a disturbance, in which late answers come in and are thrown away
ALERT = 0x80  # bit of a status packet's error byte that refers to the hardware error status
PORT_ERRORS = (OSError, TerminalError)
BROKEN_ANSWER = (IndexError, TypeError)  # errors that the SDK raises for some damaged packets
POLL_S = 0.001
WRITE_TIMEOUT_S = 0.1

REFUSALS = {
    1: "could not do it",
    2: "does not know the instruction",
    3: "got a damaged packet",
    4: "reports that the value is out of range",
    5: "reports that the value has the wrong length",
    6: "reports that the value is beyond a limit",
    7: "does not allow access",
}
"""The error numbers of a status packet (ROBOTIS e-Manual, Protocol 2.0, section 4.3.6)."""


class Answer(NamedTuple):
    """An answer of the motor: the bytes read, none for a write, and whether it reports a hardware error."""

    data: bytes
    alert: bool


class Bus:
    """One motor, by its id, on an open `dynamixel_sdk.PortHandler`, or an object that behaves like one."""

    def __init__(self, port: Any, motor_id: int, clock: Clock) -> None:
        self.motor_id = motor_id
        self.damaged = 0
        """Number of answers that were lost, damaged or a refusal so far; each was requested again."""
        self._port = port
        self._clock = clock
        self._packets = PacketHandler(2.0)

    def ping(self) -> int:
        """Ping the motor and return its model number.

        Raises:
            NoAnswer: nobody answers.
        """
        model_and_firmware = self._ask("reach it", INST_PING, b"", 3, TRIES).data
        return int.from_bytes(model_and_firmware[:2], "little")

    def read(self, register: Register, tries: int = TRIES) -> Answer:
        """Read the bytes of a register.

        Raises:
            NoAnswer: no whole answer came, or the port is gone.
            MotorFault: the motor refuses.
        """
        params = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
        return self._ask(f"read its {register.name}", INST_READ, params, register.size, tries)

    def write(self, register: Register, value: int, tries: int = TRIES) -> Answer:
        """Write a value, signed or not; raises as `read`.

        Args:
            register: the register.
            value: its new value.
            tries: how often to ask before giving up.
        """
        data = (value % 256**register.size).to_bytes(register.size, "little")
        params = register.address.to_bytes(2, "little") + data
        return self._ask(f"set its {register.name} to {value}", INST_WRITE, params, 0, tries)

    def _ask(self, what: str, instruction: int, params: bytes, size: int, tries: int) -> Answer:
        """Ask until a whole answer of `size` bytes comes without a refusal."""
        failure: MotorFault = NoAnswer(f"no time to {what}")
        for attempt in range(tries):
            try:
                packet, result, error = self._exchange(instruction, params)
            except PORT_ERRORS as gone:
                raise NoAnswer(f"the port is gone while trying to {what}: {gone}") from gone
            data = b""
            if result == COMM_SUCCESS:  # the data are between the error byte and the checksum of a whole packet
                data = bytes(packet[9 : 5 + packet[5] + 256 * packet[6]])
            if result == COMM_SUCCESS and not error & ~ALERT and len(data) == size:
                if attempt:
                    self._clock.sleep(SETTLE_S)
                return Answer(data, bool(error & ALERT))
            failure = _failure(what, result, error)
            self.damaged += 1
        raise failure

    def _exchange(self, instruction: int, params: bytes) -> tuple[list[int], int, int]:
        """Send one packet and receive one: the packet, the SDK's result and the packet's error byte."""
        length = len(params) + 3  # instruction and checksum count too
        packet = [0, 0, 0, 0, self.motor_id, length % 256, length // 256, instruction, *params, 0, 0]
        self._port.is_using = False
        try:
            answer, result, error = self._packets.txRxPacket(self._port, packet)
        except BROKEN_ANSWER:
            return [], COMM_RX_CORRUPT, 0
        return answer or [], result, error


def open_port(name: str, baud: int) -> Any:
    """Open a serial port for this program alone, with the least latency that can be had.

    Raises:
        UserError: it cannot be opened.
    """
    port = PortHandler(name)
    try:
        opened = port.setBaudRate(baud)
    except (*PORT_ERRORS, ValueError) as error:
        raise UserError(
            f"port {name} cannot be opened at {baud} baud; found: {error}; expected: the serial port of the motor's "
            "adapter, which you may read and write. `calib capture scan` lists the ports; on Linux your user may have "
            "to join the group dialout."
        ) from error
    if not opened:
        raise UserError(f"baud rate {baud} is not one of {', '.join(map(str, BAUD_RATES))}")
    _tune(port, name)
    return port


def _tune(port: Any, name: str) -> None:
    """Lock the port, let reads wait instead of spin, bound writes, and shorten the adapter's 16 ms latency."""
    try:
        port.ser.exclusive = True
    except PORT_ERRORS as error:
        port.closePort()
        raise UserError(f"port {name} is in use by another program; end that one first") from error
    port.ser.timeout = POLL_S
    port.ser.write_timeout = WRITE_TIMEOUT_S
    with contextlib.suppress(*PORT_ERRORS, ValueError, AttributeError, NotImplementedError):
        port.ser.set_low_latency_mode(True)


def _failure(what: str, result: int, error: int) -> MotorFault:
    if result == COMM_SUCCESS and error & ~ALERT:
        return MotorFault(f"the motor {REFUSALS.get(error & ~ALERT, f'answers error {error}')} when asked to {what}")
    if result == COMM_RX_TIMEOUT:
        return NoAnswer(f"the motor does not answer when trying to {what}; check power and cable")
    return NoAnswer(f"only damaged answers came when trying to {what}; check the cable and its ground")
