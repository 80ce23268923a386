"""The bus of the motor: its faults, the host's clock, signals and terminal, and its serial port.

The errors that end a capture before its time:

    CaptureError          one message for the user; the command ends with `exit_code`
    ├── UserError         2: an option, a port or a folder that the user can mend; nothing was driven for it
    ├── MotorFault        3: the motor, its bus or its supply; the motor was commanded to stop
    │   └── NoAnswer      3: the motor did not answer, however often it was asked
    └── Interrupted       128 + signal: Ctrl-C 130, SIGTERM 143, SIGHUP 129

`Clock`, `Signals` and the two functions after them are the time, the signals and the terminal of the computer that
drives the motor.

`Bus` asks one motor and reads its answers, over `dynamixel_sdk`, whose known faults are worked around here.

- After an exception in the middle of an answer, `port.is_using` stays True and every later packet, a torque-off among
  them, is silently not sent: it is reset before every packet.
- A packet that needs stuffing is sent unstuffed. None that is sent here does: see the tests.
- Values come back unsigned: they are decoded from the bytes.
- An answer that is longer or shorter than what was requested, such as a late one to an earlier question, is cut to the
  length requested, if need be with its checksum as data: the length of the packet is checked here. Blocks that are
  read therefore differ in length.
- It busy-waits for an answer: the port is given a time-out of its own.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any, NamedTuple

from dynamixel_sdk import COMM_RX_CORRUPT, COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler, PortHandler
from dynamixel_sdk.robotis_def import INST_PING, INST_READ, INST_WRITE

from calib.capture.registers import Register

try:
    from termios import error as TerminalError
except ImportError:  # Windows
    TerminalError = OSError  # type: ignore[misc, assignment]

INTERRUPTED = 130
"""The exit code after Ctrl-C, 128 + SIGINT, as shells and typer have it."""

_IN_ASCII = {
    "\N{MINUS SIGN}": "-",
    "\N{EN DASH}": "-",
    "\N{PLUS-MINUS SIGN}": "+/-",
    "\N{MULTIPLICATION SIGN}": "x",
    "\N{HORIZONTAL ELLIPSIS}": "...",
    "\N{RIGHTWARDS ARROW}": "->",
    "\N{GREEK SMALL LETTER BETA}": "beta",
}

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


class CaptureError(Exception):
    """An error that ends a capture with a message instead of a traceback.

    Example:
        >>> try:
        ...     calib.capture.run("/dev/nothing", [0.6], "logged")
        ... except calib.capture.CaptureError as error:
        ...     print(error)
        port /dev/nothing cannot be opened at 57600 baud; found: ... `calib capture scan` lists the ports; ...
    """

    exit_code = 2


class UserError(CaptureError):
    """Faults the user can mend, all of them at once.

    Example:
        >>> try:
        ...     calib.capture.run("/dev/ttyUSB0", "0.6,fast", "logged", kind="wet")
        ... except calib.capture.UserError as error:
        ...     print(error)
        --hz: found 'fast'; expected: 0.01 to ... crank turns a second; ...
        --kind: found 'wet'; choices: swim, dry
    """

    def __init__(self, faults: str | Sequence[str]) -> None:
        super().__init__(faults if isinstance(faults, str) else "\n".join(faults))


class MotorFault(CaptureError):
    """The motor, its bus or its supply does not do what it should.

    Example:
        >>> try:
        ...     calib.capture.run("/dev/ttyUSB0", [0.6], "logged", max_current_a=0.01, report=lambda line: None)
        ... except calib.capture.MotorFault as error:
        ...     print(error)
        the current is too high; found: ... A for 0.5 s; expected: at most 0.01 A (--max-current). Does the tail ...
    """

    exit_code = 3


class NoAnswer(MotorFault):
    """The motor did not answer."""


class Interrupted(CaptureError):
    """A signal asked the program to end."""

    def __init__(self, number: int) -> None:
        self.exit_code = 128 + number
        super().__init__(
            "stopped by Ctrl-C" if number == signal.SIGINT else f"stopped by {signal.Signals(number).name}"
        )


# Time, signals and terminal of the host.


class Clock(NamedTuple):
    """The source of time, seconds on a clock that never steps; tests use a virtual one."""

    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


class Signals:
    """A recorder of the signals that ask the program to end, within a ``with`` block.

    They are checked between two exchanges with the motor (`raise_if_any`) instead of breaking into one, so that neither
    an exchange nor the stop is ever cut in the middle, however often Ctrl-C is pressed.
    """

    WATCHED = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

    def __init__(self) -> None:
        self.caught: int | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Signals:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in self.WATCHED}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def raise_if_any(self) -> None:
        """Raise `Interrupted` if a signal came."""
        if self.caught is not None:
            raise Interrupted(self.caught)

    def _note(self, number: int, _frame: FrameType | None) -> None:
        if self.caught is None:
            self.caught = number


def print_in_any_encoding() -> None:
    """Spell output in what the encoding of a terminal or file has, so that it no longer ends the program."""
    codecs.register_error("in_ascii", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="in_ascii")


def let_go_of_a_lost_terminal() -> None:
    """Redirect what Python still holds for a lost terminal, so that it does not end with exit code 120."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    """Handle characters that a terminal's encoding does not have: use another spelling, or the number of each."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(each) or ascii(each)[1:-1] for each in missing), error.end


# The bus.


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
