"""``calib capture scan | run | emulate``, also ``python -m calib.capture``."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from calib.capture.bus import BAUD_RATES
from calib.capture.errors import CaptureError, Interrupted, UserError
from calib.capture.functions import REACH, complain, emulate, run, scan, show
from calib.capture.guard import Limits
from calib.capture.host import INTERRUPTED


def main(arguments: Sequence[str] | None = None, program: str = "calib capture") -> int:
    """Runs one command and returns the exit code: 0, 2 for the user's errors, 3 for a motor fault, 128 + signal."""
    options = _parser(program).parse_args(arguments)
    try:
        options.command(options)
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
    parser = argparse.ArgumentParser(prog=program, description="Drives and logs the robot's motor.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    search = commands.add_parser(
        "scan", help="find the motor: port, baud rate and id", epilog="Example: calib capture scan"
    )
    search.add_argument("--port", action="append", help="look here only; may be given again")
    search.add_argument(
        "--baud", action="append", type=int, choices=BAUD_RATES, help="at this baud rate only; may be given again"
    )
    search.set_defaults(command=_scan)
    example = "Example: calib capture run --port /dev/ttyUSB0 --hz 0.6,0.8,1.0 --out pool"
    _add_run(commands.add_parser("run", help="drive speeds, log them and add them to a session", epilog=example))
    example = "Example: calib capture emulate --load 1.5"
    motor = commands.add_parser("emulate", help="an emulated motor, to try things out on", epilog=example)
    motor.add_argument("--id", type=int, default=1, help="of the emulated motor (default: 1)")
    motor.add_argument("--baud", type=int, default=57600, choices=BAUD_RATES, help="its baud rate (default: 57600)")
    motor.add_argument("--load", type=float, default=0.0, help="friction on its shaft, N m; 6.9 stall it (default: 0)")
    motor.add_argument("--seed", type=int, default=0, help="draws the angle it starts at (default: 0)")
    motor.set_defaults(command=lambda given: emulate(given.id, given.baud, given.load, given.seed))
    return parser


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--port", required=True, help="serial port, such as /dev/ttyUSB0")
    parser.add_argument("--baud", type=int, default=57600, help="baud rate (default: 57600, the factory's)")
    parser.add_argument("--id", type=int, default=1, help="of the motor (default: 1)")
    parser.add_argument("--hz", required=True, help=f"speeds, comma-separated: {REACH}")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each speed (default: 20)")
    parser.add_argument("--out", type=Path, required=True, help="session folder; made when it is not there")
    parser.add_argument("--kind", choices=("swim", "dry"), default="swim", help="of the trials (default: swim)")
    parser.add_argument(
        "--role", choices=("fit", "holdout"), default="fit", help="fitted, or held out for the forecast (default: fit)"
    )
    parser.add_argument("--no-code", action="store_true", help="without the coded wiggles that align video and log")
    parser.add_argument("--max-current", type=float, default=Limits.current_a, help="ampere (default: %(default)s)")
    parser.add_argument(
        "--max-temperature", type=float, default=Limits.temperature_c, help="degrees C (default: %(default)s)"
    )
    parser.set_defaults(command=_run)


def _scan(options: argparse.Namespace) -> None:
    found = scan(options.port or (), options.baud or ())
    for motor in found:
        show(motor.describe())
    if not any(motor.is_ours for motor in found):
        raise UserError("no XW540-T140-R answers. Has it power (12 V)? Is its cable plugged in at both ends?")


def _run(options: argparse.Namespace) -> None:
    added = run(
        options.port,
        options.hz,
        options.out,
        baud=options.baud,
        motor_id=options.id,
        seconds=options.seconds,
        kind=options.kind,
        role=options.role,
        coded=not options.no_code,
        max_current_a=options.max_current,
        max_temperature_c=options.max_temperature,
    )
    trials = "1 trial" if len(added) == 1 else f"{len(added)} trials"
    show(f'{options.out}: {trials} added, role = "{options.role}"')
