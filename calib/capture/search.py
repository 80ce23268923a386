"""The search for motors: which answer, on which port, at which baud rate, under which id."""

import glob
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from dynamixel_sdk import PacketHandler

from calib.capture.bus import BAUD_RATES, PORT_ERRORS, Bus, open_port
from calib.capture.errors import MotorFault, UserError
from calib.capture.host import Clock
from calib.capture.registers import MODEL

PORT_PATTERNS = ("/dev/ttyUSB*", "/dev/ttyACM*", "/dev/tty.usbserial*", "/dev/tty.usbmodem*")
BAUD_ORDER = (57600, 1_000_000, *(baud for baud in BAUD_RATES if baud not in (57600, 1_000_000)))
"""Baud rates in the order of the search: the factory's first, then the SDK's, then the rest."""


class Found(NamedTuple):
    """A motor that answered.

    Example:
        >>> found = calib.capture.scan(["/dev/ttyUSB0"], [57600], report=lambda line: None)[0]
        >>> found.motor_id, found.is_ours
        (1, True)
    """

    port: str
    baud: int
    motor_id: int
    model: int

    @property
    def is_ours(self) -> bool:
        """Whether it is an XW540-T140-R."""
        return self.model == MODEL

    def describe(self) -> str:
        """Describe the motor in one line."""
        what = "XW540-T140-R" if self.is_ours else f"another Dynamixel, model {self.model}"
        return f"--port {self.port} --baud {self.baud} --id {self.motor_id}  ({what})"


def ports() -> list[str]:
    """List the serial ports that an adapter may be on."""
    return sorted(port for pattern in PORT_PATTERNS for port in glob.glob(pattern))  # noqa: PTH207  device names


def search(names: Sequence[str], bauds: Sequence[int], report: Callable[[str], None]) -> list[Found]:
    """Ask on every port at every baud rate which motors are there.

    A port that cannot be opened is reported and left out.

    Args:
        names: names of the serial ports.
        bauds: baud rates.
        report: receives each port and rate, and warnings.
    """
    found: list[Found] = []
    for name in names:
        for baud in bauds:
            report(f"{name} at {baud} baud")
            try:
                port = open_port(name, baud)
            except UserError as error:
                report(f"warning: {error}")
                break
            try:
                found.extend(Found(name, baud, *motor) for motor in _motors(port))
            finally:
                port.closePort()
    return found


def _motors(port: Any) -> Iterator[tuple[int, int]]:
    """Yield id and model of each motor that answers a ping to all, and then one of its own."""
    try:
        answers, _ = PacketHandler(2.0).broadcastPing(port)
    except PORT_ERRORS:
        return
    for motor_id in sorted(answers):
        try:
            yield motor_id, Bus(port, motor_id, Clock()).ping()
        except MotorFault:
            continue
