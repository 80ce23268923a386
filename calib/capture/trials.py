"""One capture: every speed driven, logged and added to the session; the motor is stopped on every way out."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from calib.capture import registers
from calib.capture.bus import Bus
from calib.capture.errors import CaptureError, MotorFault, UserError
from calib.capture.guard import RISE_S, Guard, Limits
from calib.capture.host import Clock, Signals
from calib.capture.logs import FEWEST_ROWS, TrialLog
from calib.capture.motor import SILENCE_S, Motor, Reading
from calib.capture.plan import TrialPlan, trial_name
from calib.capture.session_text import SessionText

PERIOD_S = 0.01
SLOWEST_LOG_HZ = 50.0
RENEWAL_S = 0.2  # time after which the goal is written again, so that a trip of the watchdog is noticed
NEAR_REACH = 0.9

UNCONFIRMED = (
    "the motor did not confirm that it stopped. Its own bus watchdog stops it within "
    f"{SILENCE_S:g} s of the last packet it got; take its power away to be sure."
)

Report = Callable[[str], None]


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
) -> list[TrialResult]:
    """Drive and log every speed, and add each finished trial to the session.

    A trial cut short stays on disk, but is not added.

    Args:
        settings: what is captured.
        port: the open serial port.
        report: receives what is going on, a sentence at a time.
        clock: the source of time.

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
            result = _Trial(plan, motor, Guard(settings.limits), signals, clock).run(session.trials, report)
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
        end_s = self.clock.now()  # steps end on a fixed schedule, so that the delay of one does not move the next
        for step in self.plan.steps():
            end_s += step.seconds
            units = registers.velocity_units(step.turns_per_s)
            done_s = self.motor.set_speed(units)
            log.commanded(done_s, step.part, units)
            self.guard.command(units, done_s)
            self._log_until(end_s, units, log, done_s + RISE_S if step.part == "drive" else math.inf)

    def _log_until(self, end_s: float, units: int, log: TrialLog, settled_s: float) -> None:
        """Read and log on a fixed beat until the time comes."""
        next_s = renewed_s = self.clock.now()
        while self.clock.now() < end_s:
            self.signals.raise_if_any()
            if next_s - renewed_s >= RENEWAL_S:
                renewed_s = self.motor.set_speed(units)
            reading = self.motor.read()
            log.measured(reading, steady=reading.time_s >= settled_s)
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
