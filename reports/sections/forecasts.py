"""The section on speeds and markers: the exported twin, simple rules and elongated body theory, trial by trial."""

from collections.abc import Mapping

import numpy as np

from fitting import CalibratedTrial, Calibration
from fitting.calibration_file import CommandForecast, forecast_from_command
from fitting.ebt import EbtFit
from fitting.model.session_forecast import BEATS, GIVEN
from reports.blocks import Block, Plot, Plots, Prose, Section, Table, Terms, table_head
from reports.caveats import speed_caveats, trial_caveats
from reports.context import ReportContext
from reports.figures.forecasts import forecasts_figure
from reports.forecast_words import MODELS, correction_sentence, is_baseline, mean_speed_errors
from reports.models import model_label
from reports.numbers import MISSING, counted, in_mm, listed, percent, sentence, shown, significant, spanned

_MODELS = table_head("model | speed error [mm/s] | markers [mm] | shape alone [mm] | coordinates in 90 % band [%]")
_TRIALS = table_head(
    "trial | beat [Hz] | measured [mm/s] | twin [error] | EBT [error] | from command [error] | markers [mm] | "
    "shape alone [mm] | samples used [%] | caveats"
)


def build(context: ReportContext) -> Section:
    """Build the section: tables of trials and, with held-out trials, of models."""
    calibration = context.calibration
    blocks: list[Block] = [_trials(calibration)]
    if caveats := [(t.measured.name, text) for t in calibration.trials for text in trial_caveats(t)]:
        heads = table_head("trial | caveat")
        blocks.append(Table(f"{counted(len(caveats), 'caveat')} of single trials.", heads, tuple(caveats), folded=True))
    if calibration.forecasts.held_out:
        plot = Plot(
            forecasts_figure(calibration.forecasts),
            "forecast-speeds",
            "Held-out speeds, measured and forecast by the corrected twin with 90 % bands, and after the trial’s "
            "first two beats.",
        )
        blocks += [Plots((plot,)), _models(context)]
    if law := _law(calibration):
        blocks.append(Prose(law))
    blocks.append(Terms((("c_D / β", _theory(calibration.ebts)),), "Elongated body theory as fitted."))
    return Section("Speeds and markers", "forecasts", tuple(blocks), _caveats(context))


def _models(context: ReportContext) -> Table:
    everything = context.calibration.forecasts
    forecasts = everything.compared
    rows = []
    for model, error in mean_speed_errors(forecasts).items():
        inside = forecasts.mean(model, "inside")
        rows.append(
            (
                f"{MODELS[model]}{' (baseline)' if is_baseline(model) else ''}",
                in_mm(error),
                shown(forecasts.mean(model, "marker_error_mm")),
                shown(forecasts.mean(model, "shape_error_mm")),
                shown(100 * inside, 0),
            )
        )
    of = counted(len(everything.held_out), "held-out trial")
    fewer = len(forecasts.held_out) < len(everything.held_out)
    whose = f"{len(forecasts.held_out)} of {of}, those of which every model tells the speed" if fewer else of
    return Table(
        f"Every model over {whose}. {correction_sentence(forecasts)} Elongated body theory (EBT) uses the measured "
        "tail of the whole trial.",
        _MODELS,
        tuple(rows),
        folded=True,
    )


def _law(calibration: Calibration) -> str:
    """Say with which power of the frequency robot and twin swim; empty where the trials do not tell."""
    if (law := calibration.speed_law) is None:
        return ""
    own = {"measured": "measured", "twin": "twin", "published": "elongated body theory"}
    parts = [
        f"{own[name]} {shown(each.value, 2)}"
        + ("" if each.interval is None else f" ({spanned(*each.interval, lambda end: shown(end, 2))})")
        for name, each in law.exponents.items()
        if name in own
    ]
    return f"{law.sentence} Exponents over frequency: {listed(parts)}."


def _trials(calibration: Calibration) -> Table:
    forecasts = forecast_from_command(calibration)
    rows, totals = [], []
    for role, title in (("holdout", "held out"), ("fit", "fitted")):
        own = [trial for trial in calibration.trials if trial.measured.role == role]
        own.sort(key=lambda trial: trial.measured.frequency.hz)
        rows += [_row(trial, title, forecasts.get(trial.measured.name)) for trial in own]
        if summary := calibration.summary(role):
            few = f" ({summary.compared} of {summary.trials})" if summary.compared < summary.trials else ""
            twin, published = (in_mm(summary.speed_mae[name]) for name in ("twin", "published"))
            command = _mean_by_command(own, forecasts) if role == "holdout" else ""
            markers = shown(summary.marker_error_mm)
            totals.append((f"mean error, {title}{few}", "", "", twin, published, command, markers, "", "", ""))
    missing = [sentence(f"{name}: {flag.message}") for name, each in forecasts.items() for flag in each.flags]
    return Table(
        "Speed errors in mm/s, predicted minus measured; “from command”: the twin knows the commanded frequency alone. "
        "“Shape alone”: relative to the nose."
        + "".join(f" No forecast from the command of {each}" for each in missing),
        _TRIALS,
        tuple(rows),
        tuple(totals),
    )


def _mean_by_command(trials: list[CalibratedTrial], forecasts: Mapping[str, CommandForecast]) -> str:
    speeds = {trial.measured.name: trial.measured.speed for trial in trials}
    errors = [abs(each.speeds["twin"] - speeds[name]) for name, each in forecasts.items() if name in speeds]
    known = [error for error in errors if np.isfinite(error)]
    return in_mm(float(np.mean(known))) if known else MISSING


def _row(trial: CalibratedTrial, role: str, forecast: CommandForecast | None) -> tuple[str, ...]:
    measured, scores = trial.measured, trial.scores
    by_command = float("nan") if forecast is None else forecast.speeds["twin"]
    unknown = () if forecast is None else tuple(flag.kind.replace("_", " ") for flag in forecast.flags)
    return (
        f"{measured.name}, {role}",
        shown(measured.frequency.hz, 3),
        in_mm(measured.speed),
        *(in_mm(speed - measured.speed, signed=True) for speed in (trial.speed_twin, trial.speed_ebt, by_command)),
        in_mm(scores.marker_error_m),
        in_mm(scores.shape_error_m),
        percent(scores.used_fraction).removesuffix(" %"),
        ", ".join(dict.fromkeys((*speed_caveats(trial), *unknown))),
    )


def _theory(ebts: Mapping[str, EbtFit]) -> str:
    """State the one identifiable number of each form of the theory."""
    ratios = [f"{significant(e.drag_coefficient / (e.beta or 1.0))} ({model_label(name)})" for name, e in ebts.items()]
    at_bound = [flag.message.removeprefix("EBT: ") for ebt in ebts.values() for flag in ebt.flags]
    caveats = [sentence(text) for text in dict.fromkeys(at_bound) if "identifiable" not in text]
    return " ".join(
        [f"Of elongated body theory only the ratio c_D / β is identifiable from speeds: {listed(ratios)}.", *caveats]
    )


def _caveats(context: ReportContext) -> tuple[str, ...]:
    if not context.trials("holdout"):
        return ("No trial was held out: every error below is one of the fit.",)
    bands = [
        low <= trial.speed_measured <= high
        for trial in context.calibration.forecasts.held_out
        for model in (GIVEN, BEATS)
        if model in trial.forecasts and (band := trial.forecasts[model].speed_ci90) is not None
        for low, high in [band]
    ]
    missed = len(bands) - sum(bands)
    if missed <= 0.2 * len(bands):
        return ()
    return (f"{missed} of {len(bands)} measured speeds are outside their 90 % bands: the bands are too narrow.",)
