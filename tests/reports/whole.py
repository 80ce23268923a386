"""Contexts of a report: of a session that lacks nothing, and of sessions with as many logged trials as one likes."""

from dataclasses import replace

from fitting.calibration import Calibration
from fitting.decay_fit import fit_decay
from fitting.free_decay import measure_decay_trial
from fitting.hinges import combine_decays
from reports.context import ReportContext
from tests.fitting.free_decay.decays import CAMERA, ROBOT, Truth, decay_tracks
from tests.reports.diagnoses import made_diagnosed
from tests.reports.motors import made_logged
from tests.reports.posteriors import made_summary
from tests.reports.sample import made_calibration, made_context, made_published
from tests.reports.steered import made_circles, made_targets
from tests.reports.test_dry_runs import made_crank, made_run


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
