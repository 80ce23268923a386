"""A calibration with all there is of the dry experiments but free decays: dry runs, and motor logs everywhere."""

from dataclasses import replace

from fitting import Calibration
from tests.reports.motors import made_logged
from tests.reports.sample import made_calibration
from tests.reports.test_dry_runs import made_crank, made_run


def made_bench_calibration() -> Calibration:
    """Two dry runs and three swims, each with a motor log."""
    calibration = made_calibration()
    runs = tuple(
        replace(run, measured=replace(run.measured, motor=made_logged(hz=run.speed_hz).motor))
        for run in (made_run("dry_slow", 0.6, 0.1), made_run("dry_fast", 1.19, 4.0))
    )
    swims = tuple(
        replace(trial, measured=replace(trial.measured, motor=made_logged(hz=trial.measured.frequency.hz).motor))
        for trial in calibration.trials
    )
    return replace(calibration, trials=swims, structure=replace(calibration.structure, crank=made_crank(*runs)))
