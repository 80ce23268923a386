"""The errors that end a capture before its time, drawn once.

CaptureError          one message for the user; the command ends with `exit_code`
├── UserError         2: an option, a port or a folder that the user can mend; nothing was driven for it
├── MotorFault        3: the motor, its bus or its supply; the motor was commanded to stop
│   └── NoAnswer      3: the motor did not answer, however often it was asked
└── Interrupted       128 + signal: Ctrl-C 130, SIGTERM 143, SIGHUP 129
"""

import signal
from collections.abc import Sequence


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
        --hz: found 'fast'; expected: 0.01 to ... crank turns/s; ...
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
