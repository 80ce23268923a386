"""The functions `calib.capture.scan`, `run` and `emulate`, and the commands of the same names that call them.

`main` is the commands' parser: ``calib capture scan | run | emulate``, also ``python -m calib.capture``.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from calib.capture.bus import BAUD_RATES, INTERRUPTED, CaptureError, Interrupted, UserError, open_port
from calib.capture.emulator import STALL_NM, MotorEmulator, run_emulator
from calib.capture.live import LiveLine, live_line
from calib.capture.motor import Limits
from calib.capture.registers import RATED_TURNS_PER_S, reach_turns_per_s
from calib.capture.trials import (
    BAUD_ORDER,
    PORT_PATTERNS,
    CaptureSettings,
    Found,
    Report,
    TrialResult,
    capture,
    ports,
    search,
)

HIGHEST_SUPPLY_V = 14.8
REACH = f"up to {RATED_TURNS_PER_S:g} crank turns a second at 12 V, in proportion to the voltage"


def show(line: str, file: TextIO | None = None) -> None:
    """Print a line; a terminal that is gone must not keep the motor from being stopped."""
    with contextlib.suppress(OSError, ValueError):
        print(line, file=file, flush=True)


def complain(line: str) -> None:
    """Print a line on standard error, as `show` does."""
    show(line, sys.stderr)


def scan(port: Iterable[str] = (), baud: Iterable[int] = (), report: Report = complain) -> list[Found]:
    """Find the motor: serial port, baud rate and id.

    Args:
        port: look here only; default: every serial port.
        baud: at these rates only; default: all that the motor knows.
        report: receives where it looks.

    Returns:
        Every Dynamixel that answers; `is_ours` says whether it is an XW540-T140-R.

    Raises:
        UserError: no serial port is there.

    Example:
        >>> calib.capture.scan(baud=[57600])[0].describe()
        '--port /dev/ttyUSB0 --baud 57600 --id 1  (XW540-T140-R)'
    """
    names = list(port) or ports()
    if not names:
        raise UserError(
            f"no serial port is there; looked for: {', '.join(PORT_PATTERNS)}. Plug in the adapter, or name its "
            "port with --port."
        )
    return search(names, list(baud) or BAUD_ORDER, report)


def run(  # noqa: PLR0913
    port: str,
    hz: Sequence[float] | str,
    out: str | Path,
    *,
    baud: int = 57600,
    motor_id: int = 1,
    seconds: float = 20.0,
    kind: str = "swim",
    role: str = "fit",
    coded: bool = True,
    max_current_a: float = Limits.current_a,
    max_temperature_c: float = Limits.temperature_c,
    report: Report = show,
) -> list[TrialResult]:
    """Drive and log the motor, one trial a speed, and add each finished trial to a session; then stop the motor.

    In a terminal a line shows its speed, current and temperature meanwhile.

    Args:
        port: serial port, such as /dev/ttyUSB0.
        hz: crank turns a second of each trial: numbers, or text with commas between them.
        out: the session folder; made when it is not there.
        baud: baud rate of the motor, as `scan` finds it.
        motor_id: id of the motor, as `scan` finds it.
        seconds: duration of each trial, s.
        kind: "swim" or "dry".
        role: "fit" or "holdout".
        coded: a coded wiggle before and after each trial aligns video and log.
        max_current_a: current above which the motor is stopped, A.
        max_temperature_c: temperature above which the motor is stopped, degrees C.
        report: receives what is going on, a sentence at a time.

    Raises:
        UserError: all that is wrong with what was given; a port, folder or file that cannot be used.
        MotorFault: the motor, its bus or its supply failed, or it did not confirm that it stopped.
        Interrupted: Ctrl-C, SIGTERM or SIGHUP.

    Example:
        >>> driven = calib.capture.run("/dev/ttyUSB0", [0.6], "tank", seconds=3.0)
        motor 1: 12.0 V, reaches 1.20 turns/s without load (72 rpm at 12 V)
        f0_60: 0.6 turns/s for 3 s, ... s in all
        f0_60: ... rows at ... Hz, 0.59... turns/s measured
        >>> driven[0].rows > 200
        True
    """
    faults: list[str] = []
    speeds = _speeds(hz, faults)
    _check_address(baud, motor_id, faults)
    ampere, celsius = ("max-current", max_current_a, 4.9), ("max-temperature", max_temperature_c, 80.0)
    for name, value, most in (("seconds", seconds, 3600.0), ampere, celsius):
        if not 0 < value <= most:
            faults.append(f"--{name}: found {value:g}; expected: more than 0, at most {most:g}")
    for name, word, choices in (("kind", kind, ("swim", "dry")), ("role", role, ("fit", "holdout"))):
        if word not in choices:
            faults.append(f"--{name}: found {word!r}; choices: {', '.join(choices)}")
    if faults:
        raise UserError(faults)
    limits = Limits(max_current_a, max_temperature_c)
    settings = CaptureSettings(Path(out), speeds, seconds, motor_id, kind, role, coded, limits)
    opened = open_port(port, baud)
    try:
        with live_line(sys.stderr) as line:
            if line is None:
                return capture(settings, opened, report)
            return capture(settings, opened, partial(_report_over, line, report), live=line)
    finally:
        with contextlib.suppress(Exception):
            opened.closePort()


def emulate(motor_id: int = 1, baud: int = 57600, load_nm: float = 0.0, seed: int = 0, report: Report = show) -> None:
    """Run an emulated motor on a pseudo-terminal, to try things out on, until Ctrl-C.

    Args:
        motor_id: id of the emulated motor.
        baud: baud rate of the emulated motor.
        load_nm: friction on its shaft, N m; 6.9 stall it.
        seed: draws the angle it starts at.
        report: receives the path of the terminal, to be used as a port.

    Raises:
        UserError: a faulty argument, or a system without pseudo-terminals.

    Example:
        >>> calib.capture.emulate(load_nm=1.5)                  # in another terminal; here ended with Ctrl-C
        /dev/pts/...
        An emulated XW540-T140-R, id 1, at 57600 baud. Ctrl-C ends it.
        <BLANKLINE>
        Ended. The motor is not driven.
    """
    faults: list[str] = []
    _check_address(baud, motor_id, faults)
    if not 0 <= load_nm <= STALL_NM:
        faults.append(f"--load: found {load_nm:g}; expected: 0 to {STALL_NM:g} N m, the motor's stall torque")
    if faults:
        raise UserError(faults)
    if sys.platform == "win32":
        raise UserError("the emulator needs pseudo-terminals, which this system does not have: use Linux")
    run_emulator(MotorEmulator(motor_id, load_nm=load_nm, seed=seed), baud, report)


def _report_over(line: LiveLine, report: Report, sentence: str) -> None:
    line.clear()
    report(sentence)


def _check_address(baud: int, motor_id: int, faults: list[str]) -> None:
    if baud not in BAUD_RATES:
        faults.append(f"--baud: found {baud}; choices: {', '.join(map(str, BAUD_RATES))}")
    if not 0 <= motor_id <= 252:
        faults.append(f"--id: found {motor_id}; expected: 0 to 252")


def _speeds(hz: Sequence[float] | str, faults: list[str]) -> tuple[float, ...]:
    """Convert the speeds to numbers; a speed beyond any reach is a fault."""
    most = reach_turns_per_s(HIGHEST_SUPPLY_V)
    speeds = []
    for part in hz.split(",") if isinstance(hz, str) else hz:
        try:
            speed = float(part)
        except ValueError:
            speed = math.nan
        if not 0.01 <= speed <= most:
            found = repr(part.strip()) if isinstance(part, str) else f"{part:g}"
            faults.append(f"--hz: found {found}; expected: 0.01 to {most:.2f} crank turns a second; {REACH}")
        speeds.append(speed)
    return tuple(speeds)


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
