"""Speed over frequency, with the speeds of each trial behind it."""

import numpy as np

from fitting import CalibratedTrial
from reports.blocks import Column, Plot, Plots, Section, Table
from reports.caveats import speed_caveats
from reports.context import ReportContext
from reports.figures import speed_errors_figure, speed_sweep_figure
from reports.numbers import MISSING, in_mm, shown
from reports.svg import inline_svg

COLUMNS = (
    Column("trial", numeric=False),
    Column("role", numeric=False),
    Column("command", "Hz"),
    Column("frequency", "Hz"),
    Column("measured", "mm/s"),
    Column("twin", "mm/s"),
    Column("error", "mm/s"),
    Column("EBT, publ.", "error, mm/s"),
    Column("EBT, large", "error, mm/s"),
    Column("mind", numeric=False),
)


def build(context: ReportContext) -> Section:
    """The sweep; without held-out trials it says that its errors are those of the fit."""
    calibration = context.calibration
    low, high = calibration.sweep.fitted_hz
    diverged = int(np.isnan(calibration.sweep.speed_twin).sum())
    sweep = Plot(
        inline_svg(speed_sweep_figure(calibration), "sweep", "Forward speed over swim frequency"),
        "sweep",
        "Forward speed over swim frequency. Look for the measured points on the twin’s line, the open ones "
        "above all: they took no part in the fit. The lines forecast from the command alone: those of elongated "
        "body theory (EBT) use the twin’s tail, its points the measured one.",
        f"Shaded and dashed: outside the fitted {shown(low, 2)} to {shown(high, 2)} Hz, so extrapolated."
        + (f" The twin diverged at {diverged} frequencies, which are left out." if diverged else ""),
    )
    errors = Plot(
        inline_svg(speed_errors_figure(calibration), "speed-errors", "Error of the predicted speed by trial"),
        "speed-errors",
        "How far off each prediction is, fastest trial on top. Filled marks are fit trials, open ones were held out.",
    )
    return Section(
        "Speed",
        "speed",
        (Plots((sweep, errors)), _table(context)),
        () if context.trials("holdout") else ("No trial was held out: every speed error below is one of the fit.",),
    )


def _table(context: ReportContext) -> Table:
    trials = sorted(context.calibration.trials, key=lambda trial: trial.measured.frequency.hz)
    totals = []
    for role, title in (("fit", "fit"), ("holdout", "held out")):
        if summary := context.calibration.summary(role):
            twin, published, large = (in_mm(summary.speed_mae[name]) for name in ("twin", "published", "large"))
            totals.append(("mean", title, "", "", "", "", twin, published, large, ""))
    return Table(
        "Forward speed of each trial: slope over the whole beats of the compared frames, forward positive. "
        "Means are of absolute errors.",
        COLUMNS,
        tuple(_row(trial) for trial in trials),
        tuple(totals),
    )


def _row(trial: CalibratedTrial) -> tuple[str, ...]:
    measured = trial.measured
    frequency = f"{shown(measured.frequency.hz, 4)} ± {shown(measured.frequency.se_hz, 4)}"
    models = (trial.speed_twin, trial.ebt["published"], trial.ebt["large"])
    return (
        measured.name,
        "fit" if measured.role == "fit" else "held out",
        shown(measured.commanded_hz, 2),
        frequency,
        in_mm(measured.speed),
        in_mm(trial.speed_twin),
        *(in_mm(speed - measured.speed, signed=True) for speed in models),
        ", ".join(speed_caveats(trial)) or MISSING,
    )
