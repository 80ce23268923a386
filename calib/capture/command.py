"""The commands ``calib capture scan | run | emulate``, also ``python -m calib.capture``."""

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from calib.capture.bus import BAUD_RATES
from calib.capture.errors import CaptureError, Interrupted, UserError
from calib.capture.functions import REACH, complain, emulate, run, scan, show
from calib.capture.guard import Limits
from calib.capture.host import INTERRUPTED


def main(arguments: Sequence[str] | None = None, program: str = "calib capture") -> int:
    """Run one command and return the exit code: 0, 2 for the user's errors, 3 for a motor fault, 128 + signal."""
    given = vars(_parser(program).parse_args(arguments))
    command = given.pop("command")
    try:
        command(**given)
        return 0
    except CaptureError as error:
        for line in str(error).splitlines():
            complain(f"{program}: {line}")
        if isinstance(error, Interrupted):
            complain(f"{program}: trials that were finished are in the session")
        return error.exit_code
    except KeyboardInterrupt:
        complain(f"{program}: stopped by Ctrl-C")
        return INTERRUPTED


def _parser(program: str) -> argparse.ArgumentParser:
    """Build the parser; an option that is not given is left to the default of the function's parameter of that name."""
    parser = argparse.ArgumentParser(prog=program, description="Drive and log the robot's motor.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    add = partial(commands.add_parser, argument_default=argparse.SUPPRESS)
    search = add("scan", help="find the motor: port, baud rate and id", epilog="Example: calib capture scan")
    search.add_argument("--port", action="append", help="look here only; may be given again")
    search.add_argument(
        "--baud", action="append", type=int, choices=BAUD_RATES, help="at this baud rate only; may be given again"
    )
    search.set_defaults(command=_scan)
    example = "Example: calib capture run --port /dev/ttyUSB0 --hz 0.6,0.8,1.0 --out pool"
    _add_run(add("run", help="drive speeds, log them and add them to a session", epilog=example))
    example = "Example: calib capture emulate --load 1.5"
    motor = add("emulate", help="an emulated motor, to try things out on", epilog=example)
    motor.add_argument("--id", dest="motor_id", metavar="ID", type=int, help="id of the emulated motor (default: 1)")
    motor.add_argument("--baud", type=int, choices=BAUD_RATES, help="its baud rate (default: 57600)")
    motor.add_argument(
        "--load",
        dest="load_nm",
        metavar="LOAD",
        type=float,
        help="friction on its shaft, N m; 6.9 stall it (default: 0)",
    )
    motor.add_argument("--seed", type=int, help="draws the angle it starts at (default: 0)")
    motor.set_defaults(command=emulate)
    return parser


def _add_run(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--port", required=True, help="serial port, such as /dev/ttyUSB0")
    add("--baud", type=int, help="baud rate (default: 57600, the factory's)")
    add("--id", dest="motor_id", metavar="ID", type=int, help="id of the motor (default: 1)")
    add("--hz", required=True, help=f"speeds, comma-separated: {REACH}")
    add("--seconds", type=float, help="duration of each speed, s (default: 20)")
    add("--out", type=Path, required=True, help="session folder; made when it is not there")
    add("--kind", choices=("swim", "dry"), help="kind of the trials (default: swim)")
    add("--role", choices=("fit", "holdout"), help="fitted, or held out for the forecast (default: fit)")
    add("--no-code", dest="coded", action="store_false", help="without the coded wiggles that align video and log")
    add("--max-current", dest="max_current_a", metavar="A", type=float, help=f"ampere (default: {Limits.current_a:g})")
    add(
        "--max-temperature",
        dest="max_temperature_c",
        metavar="C",
        type=float,
        help=f"degrees C (default: {Limits.temperature_c:g})",
    )
    parser.set_defaults(command=_run)


def _scan(**given: Any) -> None:
    found = scan(**given)
    for motor in found:
        show(motor.describe())
    if not any(motor.is_ours for motor in found):
        raise UserError("no XW540-T140-R answers. Has it power (12 V)? Is its cable plugged in at both ends?")


def _run(out: Path, role: str = "fit", **given: Any) -> None:
    added = run(out=out, role=role, **given)
    trials = "1 trial" if len(added) == 1 else f"{len(added)} trials"
    show(f'{out}: {trials} added, role = "{role}"')
