"""The section on the motor: commanded against measured speed, how evenly it turns, its clock, supply and
temperature.
"""

from collections.abc import Callable

import numpy as np

from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.motor import motor_speed_figure, motor_turn_figure
from reports.logged_trial import LoggedTrial
from reports.numbers import MISSING, counted, listed, percent, sentence, shown, with_error

MILLION = 1e6
TURNING = table_head(
    "trial | kind | commanded [turns/s] | measured [turns/s] | off command [%] | ripple [%] | clock [ahead by, s] | "
    "rate [fast by, ppm] | found by"
)
SUPPLY = table_head(
    "trial | rows [a second] | current [A, mean] | current [A, highest] | voltage [V, mean] | voltage [V, lowest] | "
    "temperature [°C, first to last] | hardware errors"
)


def build(context: ReportContext) -> Section | None:
    """Build the section; None where no trial has a log."""
    return motor_section(context.logged) if context.logged else None


def motor_section(trials: tuple[LoggedTrial, ...]) -> Section:
    """Build the section from logged trials: two tables, and their speeds drawn."""
    turning = Table(
        "Speed over the steady stretch, and the clock of the log against the video’s, ± standard error.",
        TURNING,
        tuple(map(_turning_row, trials)),
        folded=True,
    )
    caption = "What the motor drew, and what it reported."
    supply = Table(caption, SUPPLY, tuple(map(_supply_row, trials)), folded=True)
    return Section(
        "Motor",
        "motor",
        (Prose(_text(trials)), turning, Plots(_plots(trials)), supply),
        tuple(sentence(f"{trial.name}: {flag.message}") for trial in trials for flag in trial.motor.flags),
    )


def _text(trials: tuple[LoggedTrial, ...]) -> str:
    ripple = max(trial.motor.ripple for trial in trials)
    off = max(((abs(t.off_command), t.name) for t in trials if t.motor.commanded_hz > 0), default=None)
    command = "" if off is None else f" The mean speed is off the command by up to {percent(off[0])} ({off[1]})."
    return (
        f"The motor was logged in {counted(len(trials), 'trial')}{_say_followed(trials)}. Within a turn its speed "
        f"swings by up to ±{percent(ripple)}.{command}"
    )


def _say_followed(trials: tuple[LoggedTrial, ...]) -> str:
    unused = [trial.name for trial in trials if not trial.motor.usable]
    if len(unused) == len(trials):
        return ", but no log could be used: every crank is taken to turn evenly"
    but = f", but not in {listed(unused)}, where the log is not used: see below" if unused else ""
    return f", and the twin’s crank follows the measured angle instead of an even turn{but}"


def _turning_row(trial: LoggedTrial) -> tuple[str, ...]:
    motor, clock = trial.motor, trial.motor.clock
    return (
        trial.name,
        "dry run" if trial.kind == "dry" else "swim",
        shown(motor.commanded_hz, 3),
        shown(motor.measured_hz, 4),
        shown(100 * trial.off_command, 2, signed=True),
        shown(100 * motor.ripple, 2),
        with_error(clock.offset_s, clock.offset_se_s, 3) if motor.laid else MISSING,
        with_error(MILLION * (clock.rate - 1), MILLION * clock.rate_se, 0) if motor.laid else MISSING,
        clock.found_by if motor.usable else f"{clock.found_by}, not used",
    )


def _supply_row(trial: LoggedTrial) -> tuple[str, ...]:
    log, steady = trial.motor.log, trial.steady
    current, voltage = np.abs(log.current_a[steady]), log.voltage_v[steady]
    warmth = log.temperature_c[np.isfinite(log.temperature_c)]
    errors = np.unique(log.error[np.isfinite(log.error) & (log.error != 0)])
    return (
        trial.name,
        shown(float(1 / np.median(np.diff(log.time_s))), 0),
        shown(_summarise(np.nanmean, current), 2),
        shown(_summarise(np.nanmax, current), 2),
        shown(_summarise(np.nanmean, voltage), 1),
        shown(_summarise(np.nanmin, voltage), 1),
        f"{warmth[0]:.0f} to {warmth[-1]:.0f}" if len(warmth) else MISSING,
        ", ".join(f"0x{int(error):02x}" for error in errors) or "none",
    )


def _summarise(summary: Callable[[np.ndarray], float], values: np.ndarray) -> float:
    """Apply a summary to the values that are there; nan where none is."""
    return float(summary(values)) if np.isfinite(values).any() else float("nan")


def _plots(trials: tuple[LoggedTrial, ...]) -> tuple[Plot, ...]:
    apart = listed([trial.name for trial in trials if not trial.motor.laid])
    own = f". {apart} could not be laid on the video: time from the beginning of the log" if apart else ""
    speeds = Plot(
        motor_speed_figure(trials),
        "motor-speed",
        "Speed of the crank over each trial and its command. Grey ground: coded wiggles; the bar on top: the steady "
        f"stretch{own}.",
    )
    turns = Plot(
        motor_turn_figure(trials),
        "motor-turn",
        "Speed through a turn of the shaft, about its mean. Grey: each turn; heavy: their mean. A pattern that all "
        "trials share belongs to the mechanism, one that grows with the speed to the load.",
    )
    return speeds, turns
