"""``calib capture scan | run | emulate``, also ``python -m calib.capture``."""

import argparse
import contextlib
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from calib.capture.bus import BAUD_RATES, open_port
from calib.capture.errors import CaptureError, Interrupted, UserError
from calib.capture.guard import Limits
from calib.capture.host import INTERRUPTED
from calib.capture.registers import RATED_TURNS_PER_S, reach_turns_per_s
from calib.capture.run import CaptureSettings, capture
from calib.capture.scan import BAUD_ORDER, PORT_PATTERNS, ports, scan
from calib.motor import Emulator
from calib.motor.motor_physics import MotorConstants

HIGHEST_SUPPLY_V = 14.8
STALL_N_M = MotorConstants().stall_torque_nm
REACH = f"up to {RATED_TURNS_PER_S:g} crank turns/s at 12 V, in proportion to the voltage"


def main(arguments: Sequence[str] | None = None, program: str = "calib capture") -> int:
    """Runs one command and returns the exit code: 0, 2 for the user's errors, 3 for a motor fault, 128 + signal.

    Args:
        arguments: those after the program's name; None for the process's own.
        program: what the help calls the program.
    """
    options = _parser(program).parse_args(arguments)
    try:
        return int(options.command(options))
    except CaptureError as error:
        for line in str(error).splitlines():
            _complain(f"{program}: {line}")
        if isinstance(error, Interrupted):
            _complain(f"{program}: trials that were finished are in the session")
        return error.exit_code
    except KeyboardInterrupt:
        _complain(f"{program}: stopped by Ctrl-C")
        return INTERRUPTED


def _parser(program: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=program, description="Drives and logs the robot's motor.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_scan(commands.add_parser("scan", help="find the motor: port, baud rate and id"))
    _add_run(commands.add_parser("run", help="drive speeds, log them and add them to a session"))
    _add_emulate(commands.add_parser("emulate", help="an emulated motor on a pseudo-terminal, to try things out on"))
    return parser


def _add_scan(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--port", action="append", help="look here only; may be given again")
    parser.add_argument(
        "--baud", action="append", type=int, choices=BAUD_RATES, help="at this baud rate only; may be given again"
    )
    parser.set_defaults(command=_scan)


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


def _add_emulate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--id", type=int, default=1, help="of the emulated motor (default: 1)")
    parser.add_argument("--baud", type=int, default=57600, choices=BAUD_RATES, help="its baud rate (default: 57600)")
    parser.add_argument("--load", type=float, default=0.0, help="friction on its shaft, N m; 6.9 stall it (default: 0)")
    parser.add_argument("--seed", type=int, default=0, help="draws the angle it starts at (default: 0)")
    parser.set_defaults(command=_emulate)


def _scan(options: argparse.Namespace) -> int:
    names = options.port or ports()
    if not names:
        raise UserError(
            f"no serial port is there; looked for: {', '.join(PORT_PATTERNS)}. Plug in the adapter, or name its "
            "port with --port."
        )
    found = scan(names, options.baud or BAUD_ORDER, _complain)
    for motor in found:
        _print(motor.describe())
    if not any(motor.is_ours for motor in found):
        raise UserError("no XW540-T140-R answers. Has it power (12 V)? Is its cable plugged in at both ends?")
    return 0


def _run(options: argparse.Namespace) -> int:
    settings = _settings(options)
    port = open_port(options.port, options.baud)
    try:
        capture(settings, port, _print)
    finally:
        with contextlib.suppress(Exception):
            port.closePort()
    added = "1 trial" if len(settings.hz) == 1 else f"{len(settings.hz)} trials"
    _print(f'{settings.out}: {added} added, role = "{settings.role}"')
    return 0


def _emulate(options: argparse.Namespace) -> int:
    faults: list[str] = []
    _check_id(options.id, faults)
    if not 0 <= options.load <= STALL_N_M:
        faults.append(f"--load: found {options.load:g}; expected: 0 to {STALL_N_M:g} N m, the motor's stall torque")
    if faults:
        raise UserError(faults)
    try:
        from calib.motor.pseudo_terminal import run_emulator
    except ImportError as error:
        raise UserError("the emulator needs pseudo-terminals, which this system does not have: use Linux") from error
    motor = Emulator(id=options.id, load_nm=options.load, seed=options.seed, baud=options.baud)
    run_emulator(motor, _print)
    return 0


def _settings(options: argparse.Namespace) -> CaptureSettings:
    """The options, checked.

    Raises:
        UserError: all that is wrong with them.
    """
    faults: list[str] = []
    hz = _speeds(options.hz, faults)
    if options.baud not in BAUD_RATES:
        faults.append(f"--baud: found {options.baud}; choices: {', '.join(map(str, BAUD_RATES))}")
    _check_id(options.id, faults)
    for name, most in (("seconds", 3600.0), ("max_current", 4.9), ("max_temperature", 80.0)):
        value = getattr(options, name)
        if not 0 < value <= most:
            faults.append(f"--{name.replace('_', '-')}: found {value:g}; expected: more than 0, at most {most:g}")
    if faults:
        raise UserError(faults)
    return CaptureSettings(
        out=options.out,
        hz=hz,
        seconds=options.seconds,
        motor_id=options.id,
        kind=options.kind,
        role=options.role,
        coded=not options.no_code,
        limits=Limits(options.max_current, options.max_temperature),
    )


def _check_id(motor_id: int, faults: list[str]) -> None:
    if not 0 <= motor_id <= 252:
        faults.append(f"--id: found {motor_id}; expected: 0 to 252")


def _speeds(text: str, faults: list[str]) -> tuple[float, ...]:
    """The speeds of ``--hz``; what is no speed within any reach is a fault."""
    most = reach_turns_per_s(HIGHEST_SUPPLY_V)
    speeds = []
    for part in text.split(","):
        try:
            speed = float(part)
        except ValueError:
            speed = math.nan
        if not 0.01 <= speed <= most:
            faults.append(f"--hz: found {part.strip()!r}; expected: 0.01 to {most:.2f} crank turns/s; {REACH}")
        speeds.append(speed)
    return tuple(speeds)


def _print(line: str) -> None:
    """Prints a line; a terminal that is gone must not keep the motor from being stopped."""
    with contextlib.suppress(OSError, ValueError):
        print(line, flush=True)


def _complain(line: str) -> None:
    with contextlib.suppress(OSError, ValueError):
        print(line, file=sys.stderr, flush=True)
