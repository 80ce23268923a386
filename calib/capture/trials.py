"""Trials driven by the motor: their plan, the search for a motor, and the run.

A `TrialPlan` is a list of steps, each a speed held for a time. `search` finds which motors answer, on which port, at
which baud rate, under which id. `capture` drives and logs every speed and adds it to the session; the motor is stopped
on every way out.
"""

import glob
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from dynamixel_sdk import PacketHandler

from calib.capture import registers
from calib.capture.bus import (
    BAUD_RATES,
    PORT_ERRORS,
    Bus,
    CaptureError,
    Clock,
    MotorFault,
    Signals,
    UserError,
    open_port,
)
from calib.capture.live import Live, show_nothing
from calib.capture.logs import FEWEST_ROWS, SessionText, TrialLog
from calib.capture.motor import RISE_S, SILENCE_S, Guard, Limits, Motor, Reading
from calib.capture.registers import MODEL

# The plan of a trial.
START_CODE = (1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, -1, 1, 1, -1, -1)
END_CODE = START_CODE[::-1]

CHIP_S = 0.25
CHIP_TURNS_PER_S = 0.25

REST_S = 0.5
RUN_OUT_S = 1.0  # the crank comes to rest before the end code

# The search for a motor.
PORT_PATTERNS = ("/dev/ttyUSB*", "/dev/ttyACM*", "/dev/tty.usbserial*", "/dev/tty.usbmodem*")
BAUD_ORDER = (57600, 1_000_000, *(baud for baud in BAUD_RATES if baud not in (57600, 1_000_000)))
"""Baud rates in the order of the search: the factory's first, then the SDK's, then the rest."""

# The run.
PERIOD_S = 0.01
SLOWEST_LOG_HZ = 50.0
RENEWAL_S = 0.2  # time after which the goal is written again, so that a trip of the watchdog is noticed
NEAR_REACH = 0.9

UNCONFIRMED = (
    "the motor did not confirm that it stopped. Its own bus watchdog stops it within "
    f"{SILENCE_S:g} s of the last packet it got; take its power away to be sure."
)

Report = Callable[[str], None]


class Step(NamedTuple):
    """A speed that is held for a time; `part` is "rest", "start_code", "drive" or "end_code"."""

    part: str
    turns_per_s: float
    seconds: float


@dataclass(frozen=True)
class TrialPlan:
    """One trial at `hz` crank turns a second: rest, start code, rest, drive, rest, end code, rest; codes if `coded`."""

    name: str
    hz: float
    seconds: float
    coded: bool = True

    def steps(self) -> Iterator[Step]:
        """Yield the steps in their order."""
        yield Step("rest", 0.0, REST_S)
        if self.coded:
            yield from _code("start_code", START_CODE)
            yield Step("rest", 0.0, REST_S)
        yield Step("drive", self.hz, self.seconds)
        yield Step("rest", 0.0, RUN_OUT_S)
        if self.coded:
            yield from _code("end_code", END_CODE)
            yield Step("rest", 0.0, REST_S)

    @property
    def total_s(self) -> float:
        """Duration of the whole trial, seconds."""
        return sum(step.seconds for step in self.steps())


def trial_name(hz: float, taken: Sequence[str]) -> str:
    """Name a trial after its speed, ``f0_60``, or ``f0_60_2`` where that is taken.

    Names that differ in case only count as one.
    """
    two = f"{hz:.2f}"
    name = "f" + (two if float(two) == hz else repr(hz)).replace(".", "_").replace("-", "m")
    used = {other.casefold() for other in taken}
    number = 2
    unique = name
    while unique.casefold() in used:
        unique, number = f"{name}_{number}", number + 1
    return unique


def _code(part: str, chips: Sequence[int]) -> Iterator[Step]:
    return (Step(part, chip * CHIP_TURNS_PER_S, CHIP_S) for chip in chips)


# The search for a motor.


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
        """Return whether it is an XW540-T140-R."""
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


# The run.


@dataclass(frozen=True)
class CaptureSettings:
    """The settings of a capture; as the arguments of `calib.capture.run`."""

    out: Path
    hz: tuple[float, ...]
    seconds: float = 20.0
    motor_id: int = 1
    kind: str = "swim"
    role: str = "fit"
    coded: bool = True
    limits: Limits = field(default_factory=Limits)


class TrialResult(NamedTuple):
    """One trial that was captured whole.

    Attributes:
        name: its name in the session.
        commanded_hz: crank turns a second.
        measured_hz: the mean over the drive, its first second left out; nan if it was no longer than that.
        rows: number of rows of the motor log.
        rate_hz: rows a second.
        damaged: number of answers that were lost or damaged and requested again.

    Example:
        >>> (trial,) = calib.capture.run("/dev/ttyUSB0", [0.6], "slow", seconds=3.0, report=lambda line: None)
        >>> trial.name, trial.commanded_hz, trial.damaged
        ('f0_60', 0.6, 0)
    """

    name: str
    commanded_hz: float
    measured_hz: float
    rows: int
    rate_hz: float
    damaged: int


def capture(
    settings: CaptureSettings,
    port: Any,
    report: Report,
    clock: Clock = Clock(),  # noqa: B008  it has no state
    live: Live = show_nothing,
) -> list[TrialResult]:
    """Drive and log every speed, and add each finished trial to the session.

    A trial cut short stays on disk, but is not added.

    Args:
        settings: what is captured.
        port: the open serial port.
        report: receives what is going on, a sentence at a time.
        clock: the source of time.
        live: receives every reading; it must return at once.

    Raises:
        UserError: a speed out of reach, another motor, a folder or a file that cannot be written.
        MotorFault: the motor, its bus or its supply failed; or it did not confirm that it stopped.
        Interrupted: Ctrl-C, SIGTERM or SIGHUP.
    """
    session = SessionText(settings.out)
    session.check()
    motor = Motor(Bus(port, settings.motor_id, clock), clock)
    results = []
    with Signals() as signals:
        motor.identify()
        _check_reach(settings, motor.read(), report)
        session.make_folders()
        for hz in settings.hz:
            plan = TrialPlan(trial_name(hz, session.taken_names()), hz, settings.seconds, settings.coded)
            report(f"{plan.name}: {hz:g} turns/s for {plan.seconds:g} s, {plan.total_s:.1f} s in all")
            trial = _Trial(plan, motor, Guard(settings.limits), signals, clock, live)
            result = trial.run(session.trials, report)
            session.add_trial(plan.name, settings.kind, hz, settings.role)
            results.append(result)
            _report_result(result, report)
            signals.raise_if_any()
    return results


@dataclass(frozen=True)
class _Trial:
    plan: TrialPlan
    motor: Motor
    guard: Guard
    signals: Signals
    clock: Clock
    live: Live

    def run(self, folder: Path, report: Report) -> TrialResult:
        """Drive the trial into new files of the folder; whatever happens, the motor is stopped."""
        damaged = self.motor.bus.damaged
        log = TrialLog(folder, self.plan.name)
        try:
            with log, _stopping(self.motor, report):
                self.motor.prepare(max(registers.RATED_TURNS_PER_S, self.plan.hz))
                self._drive(log)
        except CaptureError as error:
            if log.rows >= FEWEST_ROWS:
                report(f"{log.path} holds the {log.rows} rows until then; the trial was not added to the session")
            raise error
        return TrialResult(
            name=self.plan.name,
            commanded_hz=self.plan.hz,
            measured_hz=log.mean_hz,
            rows=log.rows,
            rate_hz=log.rate_hz,
            damaged=self.motor.bus.damaged - damaged,
        )

    def _drive(self, log: TrialLog) -> None:
        show = partial(self.live, self.plan.name, self.clock.now() + self.plan.total_s)
        end_s = self.clock.now()  # steps end on a fixed schedule, so that the delay of one does not move the next
        for step in self.plan.steps():
            end_s += step.seconds
            units = registers.velocity_units(step.turns_per_s)
            done_s = self.motor.set_speed(units)
            log.commanded(done_s, step.part, units)
            self.guard.command(units, done_s)
            self._log_until(end_s, units, log, done_s + RISE_S if step.part == "drive" else math.inf, show)

    def _log_until(
        self, end_s: float, units: int, log: TrialLog, settled_s: float, show: Callable[[Reading], None]
    ) -> None:
        """Read and log on a fixed beat until the time comes."""
        next_s = renewed_s = self.clock.now()
        while self.clock.now() < end_s:
            self.signals.raise_if_any()
            if next_s - renewed_s >= RENEWAL_S:
                renewed_s = self.motor.set_speed(units)
            reading = self.motor.read()
            log.measured(reading, steady=reading.time_s >= settled_s)
            show(reading)
            self.guard.check(reading)
            now = self.clock.now()
            next_s = max(next_s + PERIOD_S, now)
            self.clock.sleep(max(0.0, min(next_s, end_s) - now))


@contextmanager
def _stopping(motor: Motor, report: Report) -> Iterator[None]:
    """Stop the motor at the end of the block, however it ends; a block that ended well must see that confirmed."""
    try:
        yield
    except BaseException:
        if not motor.stop():
            report(f"warning: {UNCONFIRMED}")
        raise
    if not motor.stop():
        raise MotorFault(UNCONFIRMED)


def _check_reach(settings: CaptureSettings, reading: Reading, report: Report) -> None:
    voltage_v = reading.measured.voltage * registers.VOLT
    reach = registers.reach_turns_per_s(voltage_v)
    report(f"motor {settings.motor_id}: {voltage_v:.1f} V, reaches {reach:.2f} turns/s without load (72 rpm at 12 V)")
    faults = [
        f"{hz:g} turns/s is out of reach; expected: at most {reach:.2f} at {voltage_v:.1f} V. Leave it out of --hz."
        for hz in settings.hz
        if hz > reach
    ]
    if faults:
        raise UserError(faults)
    near = [f"{hz:g}" for hz in settings.hz if hz > NEAR_REACH * reach]
    if near:
        report(f"warning: {', '.join(near)} turns/s is near the limit: under load the motor will turn more slowly")


def _report_result(result: TrialResult, report: Report) -> None:
    speed = f"{result.measured_hz:.3f} turns/s measured"
    if math.isnan(result.measured_hz):
        speed = f"driven too briefly to measure its speed, of which the first {RISE_S:g} s do not count"
    report(f"{result.name}: {result.rows} rows at {result.rate_hz:.0f} Hz, {speed}")
    if result.rate_hz < SLOWEST_LOG_HZ:
        report(
            f"warning: logged at {result.rate_hz:.0f} Hz; expected: {SLOWEST_LOG_HZ:.0f} or more. Raise the baud rate, "
            "or lower the adapter's latency (/sys/bus/usb-serial/devices/*/latency_timer to 1)"
        )
    if result.damaged:
        report(f"warning: {result.damaged} answers were lost or damaged and asked for again; check cable and ground")
