"""Speed over frequency, with the speeds of each trial behind it."""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting import CalibratedTrial, Calibration
from fitting.calibration_file import CommandForecast, beat_to_command, forecast_from_command
from fitting.ebt import EbtFit
from fitting.speed_law import Slope, SpeedLaw
from reports.blocks import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.caveats import speed_caveats
from reports.context import ReportContext
from reports.figures.speed import speed_errors_figure, speed_sweep_figure
from reports.models import model_label
from reports.numbers import MISSING, in_mm, listed, sentence, shown, significant, spanned

COLUMNS = table_head(
    "trial | role | command [Hz] | beat [Hz] | measured [mm/s] | twin [mm/s] | error [mm/s] | from command [error] | "
    "EBT, publ. [error] | EBT, large [error] | caveats"
)


def build(context: ReportContext) -> Section:
    """The sweep; without held-out trials with a note that its errors are those of the fit."""
    calibration = context.calibration
    low, high = calibration.sweep.fitted_hz
    diverged = int(np.isnan(calibration.sweep.speed_twin).sum())
    sweep = Plot(
        speed_sweep_figure(calibration),
        "sweep",
        "Forward speed over swim frequency. Measured points should lie on the twin’s line; open points are held-out "
        "trials. All lines are simulated from the crank’s frequency alone. Elongated body theory (EBT) takes its lines "
        "from the twin’s tail motion, its points from the measured one.",
        f"Shaded and dashed: outside the fitted {shown(low, 2)} to {shown(high, 2)} Hz, so extrapolated."
        + (f" The twin diverged at {diverged} frequencies, which are left out." if diverged else ""),
    )
    errors = Plot(
        speed_errors_figure(calibration),
        "speed-errors",
        "How far off each prediction is, fastest trial on top. Filled marks are fit trials, open ones were held out.",
    )
    return Section(
        "Speed",
        "speed",
        (Plots((sweep, errors)), *_law(calibration), _table(calibration), Prose(_theory(calibration.ebts))),
        () if context.trials("holdout") else ("No trial was held out: every speed error below is one of the fit.",),
    )


def _law(calibration: Calibration) -> tuple[Block, ...]:
    """Nothing where trials tell no law."""
    law = calibration.speed_law
    if law is None:
        return ()
    labels = {"measured": "measured", "line": "line in frequency", "power_law": "power law in frequency"}
    exponents = [(labels.get(name) or model_label(name), each) for name, each in law.exponents.items()]
    rows = [(name, shown(each.value, 2), _interval(each)) for name, each in exponents]
    if law.residual is not None:
        rows.append(("measured over twin", shown(law.residual.value, 2), _interval(law.residual)))
    of_speed = Table(
        "Exponent of the speed over the beat frequency, over all trials, with its 90 % interval over trials (Student). "
        f"{law.sentence}",
        table_head("speed | exponent [] | 90 % interval []"),
        tuple(rows),
    )
    of_trials = Table(
        "What may change the law. The amplitude is half the excursion of the hindmost marker across the course of the "
        "fish in the pool; St is the Strouhal number with all of that excursion, Re the Reynolds number with the "
        f"fish's length: all three of the whole swim after its warm-up.{_trends(law)}",
        table_head("trial | beat [Hz] | stride [mm] | amplitude [mm] | St [] | Re [] | heading [°] | turning [°/s]"),
        tuple(
            (
                name,
                shown(each.frequency_hz, 2),
                in_mm(law.stride_m[name]),
                in_mm(each.amplitude_m),
                shown(each.strouhal, 2),
                f"{each.reynolds:,.0f}",
                shown(each.heading_deg, 0),
                shown(each.turning_deg_s, 1),
            )
            for name, each in law.trials.items()
        ),
    )
    return of_speed, of_trials


def _interval(slope: Slope) -> str:
    return MISSING if slope.interval is None else spanned(*slope.interval, lambda end: shown(end, 2))


def _trends(law: SpeedLaw) -> str:
    words = {"amplitude_m": "amplitude", "reynolds": "Re", "strouhal": "St", "heading_deg": "heading"}
    found = [words.get(name, "turning") for name, slope in law.trends.items() if slope.differs_from_zero]
    if not found:
        return ""
    return f" The twin's relative speed error goes with {listed(found)} (90 %); these are not independent."


def _table(calibration: Calibration) -> Table:
    trials = sorted(calibration.trials, key=lambda trial: trial.measured.frequency.hz)
    forecasts = forecast_from_command(calibration)
    missing = [f"{name}: {flag.message}" for name, forecast in forecasts.items() for flag in forecast.flags]
    without = "".join(f" No forecast from the command of {sentence(text)}" for text in missing)
    totals = []
    for role, title in (("fit", "fit"), ("holdout", "held out")):
        if summary := calibration.summary(role):
            twin, published, large = (in_mm(summary.speed_mae[name]) for name in ("twin", "published", "large"))
            commanded = _mean_by_command(trials, forecasts) if role == "holdout" else ""
            title += f" ({summary.compared} of {summary.trials})" if summary.compared < summary.trials else ""
            totals.append(("mean", title, "", "", "", "", twin, commanded, published, large, ""))
    return Table(
        "Forward speed of each trial: slope over the whole beats of the compared frames, forward positive. "
        "The twin has the frequency, phase and start of a held-out trial from its first two beats. The forecast from "
        "the command uses nothing of the trial: its frequency is the command times "
        f"{shown(beat_to_command(calibration), 3)}, the mean ratio over the fit trials. Errors are in mm/s; "
        "means are of absolute errors, over trials of which every model tells the speed."
        f"{without}",
        COLUMNS,
        tuple(_row(trial, forecasts.get(trial.measured.name)) for trial in trials),
        tuple(totals),
    )


def _mean_by_command(trials: Sequence[CalibratedTrial], forecasts: Mapping[str, CommandForecast]) -> str:
    speeds = {trial.measured.name: trial.measured.speed for trial in trials}
    errors = np.array([forecast.speeds["twin"] - speeds[name] for name, forecast in forecasts.items()])
    known = np.abs(errors[np.isfinite(errors)])
    return in_mm(float(known.mean())) if len(known) else MISSING


def _row(trial: CalibratedTrial, forecast: CommandForecast | None) -> tuple[str, ...]:
    measured = trial.measured
    by_command = float("nan") if forecast is None else forecast.speeds["twin"]
    models = (trial.speed_twin, by_command, trial.speed_ebt, trial.speeds["large"])
    unknown = () if forecast is None else tuple(flag.kind.replace("_", " ") for flag in forecast.flags)
    return (
        measured.name,
        "fit" if measured.role == "fit" else "held out",
        shown(measured.commanded_hz, 2),
        shown(measured.frequency.hz, 4),
        in_mm(measured.speed),
        in_mm(trial.speed_twin),
        *(in_mm(speed - measured.speed, signed=True) for speed in models),
        ", ".join(dict.fromkeys((*speed_caveats(trial), *unknown))) or MISSING,
    )


def _theory(ebts: Mapping[str, EbtFit]) -> str:
    """The one number of each form of the theory, and that there is only one."""
    ratios = [f"{significant(e.drag_coefficient / (e.beta or 1.0))} ({model_label(name)})" for name, e in ebts.items()]
    at_bound = [flag.message.removeprefix("EBT: ") for ebt in ebts.values() for flag in ebt.flags]
    caveats = [sentence(text) for text in dict.fromkeys(at_bound) if "identifiable" not in text]
    return " ".join(
        [
            "Elongated body theory has two numbers, the shape factor β of the added mass and the drag coefficient c_D. "
            "Thrust is proportional to β and drag to c_D, so that from speeds only their ratio c_D / β is "
            f"identifiable; β is kept at 1. Fitted to the same fit trials, it is {listed(ratios)}. The "
            "forms differ because each leaves out other effects: the ratio is no property of the robot.",
            *caveats,
        ]
    )
