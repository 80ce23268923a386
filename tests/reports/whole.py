"""Contexts of a report: of a session that lacks nothing, and of sessions with as many logged trials as one likes."""

from dataclasses import replace
from typing import Any

import numpy as np

from fitting.calibration import Calibration
from fitting.crank_fit import CrankFit, CrankTrial
from fitting.crank_surface import Cell, ErrorSurface
from fitting.decay_fit import fit_decay
from fitting.dry_run import DryTrial, TendonUse
from fitting.free_decay import measure_decay_trial
from fitting.frequency import SwimFrequency
from fitting.hinges import combine_decays
from fitting.motor_clock import MotorClock, MotorRecord
from reports.context import LoggedTrial, PolicySwims, ReportContext
from swimcal.flags import Flag
from swimcal.motor_log import MotorCommands, MotorLog
from swimcal.runs import CrankTurn
from tests.fitting.free_decay.decays import CAMERA, ROBOT, Truth, decay_tracks
from tests.reports.diagnoses import made_diagnosed
from tests.reports.posteriors import made_summary
from tests.reports.sample import made_calibration, made_context, made_published


def made_bench_calibration() -> Calibration:
    """Two dry runs and three swims, each with a motor log."""
    calibration = made_calibration()
    runs = tuple(
        replace(run, measured=replace(run.measured, motor=made_logged(hz=run.speed_hz).motor))
        for run in (made_run("dry_slow", 0.6, 0.1), made_run("dry_fast", 1.19, 4.0))
    )
    logged = of_trials(calibration, 3, logged=True)
    return replace(logged, structure=replace(calibration.structure, crank=made_crank(*runs)))


def of_trials(calibration: Calibration, count: int, *, logged: bool = False) -> Calibration:
    """The calibration with its trials again and again, each with a motor log."""
    trials = [calibration.trials[i % len(calibration.trials)] for i in range(count)]
    measured = [
        replace(
            trial.measured,
            name=trial.measured.name if i < len(calibration.trials) else f"a_trial_with_a_long_name_{i}",
            motor=made_logged(hz=trial.measured.frequency.hz).motor if logged else None,
        )
        for i, trial in enumerate(trials)
    ]
    return replace(calibration, trials=tuple(map(lambda t, m: replace(t, measured=m), trials, measured)))


def made_whole_context() -> ReportContext:
    """Of a session that lacks nothing."""
    decay = fit_decay(measure_decay_trial("decay_1", decay_tracks(Truth()), CAMERA, ROBOT), ROBOT, workers=1)
    calibration = made_bench_calibration()
    structure = replace(calibration.structure, decays=(decay,), hinges=combine_decays([decay]))
    context = made_context(replace(calibration, structure=structure))
    return replace(
        context,
        published=made_published(context.calibration),
        posterior=made_summary(),
        diagnosed=made_diagnosed(),
        policies=(made_targets(), made_circles()),
    )


OFFSET_S, RATE = 3.0, 1.001  # the motor's clock against the video's
DRIVE_S = (2.0, 8.0)  # on the video's clock
SWING = 0.05  # share of the speed, once a turn


def made_logged(
    name: str = "f0_60",
    hz: float = 0.6,
    forward: float = 1.0,
    coded: bool = True,
    **changes: Any,
) -> LoggedTrial:
    """A trial whose crank is 2 % slower than commanded, and turns by `SWING` unevenly about the shaft's zero."""
    time_s = np.arange(0.0, 10.0, 0.01)  # on the video's clock
    even = 2 * np.pi * hz * np.arange(0.0, 10.0, 1e-4)
    angle = np.interp(2 * np.pi * hz * time_s, even - SWING * np.sin(even), even)  # d angle/dt = hz/(1 - SWING cos)
    log_s = RATE * time_s + OFFSET_S
    log = MotorLog(
        time_s=log_s,
        position_rad=forward * angle,
        velocity_rad_s=forward * np.gradient(angle, log_s),
        current_a=np.full(len(time_s), -0.8),
        voltage_v=np.full(len(time_s), 11.9),
        temperature_c=np.linspace(25.0, 31.0, len(time_s)),
        error=np.zeros(len(time_s)),
    )
    reported_s = RATE * np.array([0.0, 0.5, 1.5, 2.0, 8.0, 8.5, 9.5]) + OFFSET_S
    parts = ("rest", "start_code", "rest", "drive", "rest", "end_code", "rest")
    reported = forward * 2 * np.pi * hz / 0.98 * np.array([0.0, 0.4, 0.0, 1.0, 0.0, -0.4, 0.0])
    record: dict[str, Any] = {
        "log": log,
        "commands": MotorCommands(reported_s, parts, reported) if coded else None,
        "clock": MotorClock(OFFSET_S, 0.0012, RATE, 2e-5, "code" if coded else "given", ()),
        "turn": CrankTurn.measured(log_s, log.position_rad).shifted(OFFSET_S, RATE),
        "drive_s": DRIVE_S,
        "measured_hz": hz,
        "commanded_hz": hz / 0.98,
        "ripple": SWING,
        "usable": True,
        "flags": (),
    }
    return LoggedTrial(name, "swim", MotorRecord(**(record | changes)))


def made_targets(count: int = 60) -> PolicySwims:
    """Straight to targets at 0.2 m/s; the nearest one is missed."""
    random = np.random.default_rng(3)
    start = (random.random((count, 2)) - [1.0, 0.5]) * 4.0
    away = np.hypot(*start.T)
    path = np.linspace(0.0, 1.0, 20)[:, None, None] * start[:40]
    none = np.full((2, count), np.nan)
    hit = away > away.min()
    return PolicySwims("target", "search", 300.0, 0, True, start, hit, np.zeros(count, bool), away / 0.2, none, path)


def made_circles() -> PolicySwims:
    """A circle of 1 m to either side, 5 mm off at most."""
    lap = np.linspace(0.0, 2 * np.pi, 300)
    radius = 1.0 + 0.005 * np.sin(40 * lap)
    paths = [np.stack([-radius * np.sin(lap), side * (radius * np.cos(lap) - 1)], axis=1) for side in (1.0, -1.0)]
    start, off = np.array([[-0.3, -0.045], [-0.3, 0.045]]), np.array([[0.003] * 2, [0.005] * 2])
    done, lasted = np.ones(2, bool), np.full(2, 33.0)
    return PolicySwims("circle", "sac", 60.0, 0, False, start, done, ~done, lasted, off, np.stack(paths, axis=1), 1.0)


SLACK = Flag("tendon_pushes", message="for 83 % of the turn a tendon is shorter than at rest")


def made_run(name: str, hz: float, phase_rad: float) -> CrankTrial:
    """A valley at 39 mm and this speed and phase."""
    arm, speeds, phases = np.linspace(0.03, 0.049, 20), np.linspace(0.85, 1.15, 21) * hz, np.arange(24) * np.pi / 12
    away = np.angle(np.exp(1j * (phases - phase_rad)))
    rise = 2000 * (arm - 0.039)[:, None, None] ** 2 * 1e-1 + 0.2 * ((speeds / hz - 1)[:, None]) ** 2 + 0.01 * away**2
    surface = ErrorSurface(arm, speeds, phases, 0.005 + np.sqrt(rise) * 0.1)
    n = 10
    measured = DryTrial(
        name=name,
        commanded_hz=1.02 * hz,
        markers=("nose", "neck", "caudal_fin"),
        time_s=np.arange(n) / 60.0,
        even_s=np.arange(n) / 60.0,
        place_m=np.zeros((n, 3), complex),
        head_m=np.zeros((n, 3), complex),
        weight=np.ones((n, 3)),
        scored=np.ones(n, bool),
        frequency=SwimFrequency(hz, 0.001, 0.0, 0.1, 1.0, 3.0, None),
        tail=(2,),
        flags=(),
    )
    return CrankTrial(
        measured=measured,
        speed_hz=hz,
        speed_se_hz=2e-4,
        phase_rad=phase_rad,
        phase_se_rad=0.003,
        marker_error_m=0.0052,
        scale=0.99,
        motion_error_m=0.0005,
        published=Cell(0.0391, hz, phase_rad, 0.005),
        surface=surface,
        tendons=TendonUse(0.0004, 0.018, 0.83),
        flags=(SLACK,),
    )


def made_crank(*runs: CrankTrial) -> CrankFit:
    both = runs or (made_run("dry_slow", 0.6, 0.1), made_run("dry_fast", 1.19, 4.0))
    return CrankFit(
        0.0384, 6e-5, (0.03, 0.0415), both, (Flag("at_bound", message="the arm is at the end of its range"),)
    )
