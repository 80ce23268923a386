"""Section on forecasts: every held-out trial by every model, and speed over frequency beside elongated body theory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.baselines import BASELINES
from fitting.calibration import CalibratedTrial, Calibration
from fitting.calibration_file import CommandForecast, forecast_from_command
from fitting.session_forecast import BEATS, GIVEN, SessionForecast
from reports.caveats import speed_caveats, trial_caveats
from reports.context import ReportContext
from reports.page import Block, Plot, Plots, Prose, Section, Table, Terms, table_head
from reports.style import (
    EBT,
    GAP,
    HALF_WIDTH_IN,
    INK,
    MUTED,
    SHADE,
    TWIN,
    Look,
    Margins,
    add_panel,
    legend_above,
    panel,
    role_marker,
    styled,
)
from reports.words import (
    MISSING,
    MM,
    MODELS,
    correction_sentence,
    counted,
    in_mm,
    is_baseline,
    listed,
    mean_speed_errors,
    model_label,
    percent,
    sentence,
    shortened,
    shown,
    significant,
    spanned,
)

if TYPE_CHECKING:
    from fitting.posterior.prediction import PredictedSweep
    from fitting.posterior.summary import PosteriorSummary

# Forecasts of the trials
_SHIFT = 0.17  # distance of a model from the middle of its row, in rows

# The sweep of the speed
WIDTH_IN = 6.3
_NARROW_IN = 3.7
_HEIGHT_IN = 3.41  # without the legend
_BELOW_IN = 1.2  # height of the lower panel
_BOTTOM_IN = 0.42
_LEFT_IN = 0.66
_RULES: dict[str, Look] = {
    "line": {"linestyle": (0, (1, 1.6))},
    "constant_stride": {"linestyle": (0, (6, 2, 1, 2))},
}

# Tables
_MODELS = table_head("model | speed error [mm/s] | markers [mm] | shape alone [mm] | coordinates in 90 % band [%]")
_TRIALS = table_head(
    "trial | beat [Hz] | measured [mm/s] | twin [error] | EBT [error] | from command [error] | markers [mm] | "
    "shape alone [mm] | samples used [%] | caveats"
)


@styled
def forecasts_figure(forecasts: SessionForecast) -> Figure:
    """Draw a row for each held-out trial, slowest at the bottom: measured, by the model with bands, by the
    best rule.
    """
    found = {name: trial for name, trial in forecasts.trials.items() if trial.role != "fit"}
    names = sorted(found, key=lambda name: found[name].frequency_hz)
    best = forecasts.best_baseline
    figure, axes = panel(HALF_WIDTH_IN, 1.3 + 0.42 * len(names), Margins(left=0.85, top=0.52))
    labels = {GIVEN: "corrected twin", BEATS: "corrected, two beats"}
    for row, name in enumerate(names):
        trial = found[name]
        measured = trial.speed_measured * MM
        axes.plot([measured] * 2, [row - 0.34, row + 0.34], color=INK, linewidth=1.6, label="measured")
        for model, colour, shift in ((GIVEN, TWIN, _SHIFT), (BEATS, EBT, -_SHIFT)):
            if model not in trial.forecasts:
                continue
            forecast, at = trial.forecasts[model], row + shift
            if forecast.speed_ci90 is not None:
                axes.plot(np.array(forecast.speed_ci90) * MM, [at] * 2, color=colour, linewidth=1.4)
            axes.plot(forecast.speed * MM, at, "o", color=colour, markersize=5, label=labels[model])
        if best:
            look: Look = {"color": MUTED, "markersize": 5, "label": MODELS[best]}
            axes.plot(trial.forecasts[best].speed * MM, row, "D", **look)
    axes.set_yticks(range(len(names)), [shortened(name) for name in names])
    axes.set(ylim=(-0.6, len(names) - 0.4), xlabel="forward speed (mm/s)")
    legend_above(axes, 2)
    return figure


@styled
def speed_sweep_figure(
    calibration: Calibration, posterior: PosteriorSummary | None = None, narrow: bool = False
) -> Figure:
    """Draw the speeds above, and below the same minus the twin's.

    Frequencies on grey ground were not fitted. The band is the posterior's, about the corrected twin; each held-out
    trial has its own, and is red where it lies outside.

    Args:
        calibration: the calibration.
        posterior: its posterior; default: no bands.
        narrow: whether it is drawn for the screen of a phone.
    """
    predicted = None if posterior is None else posterior.sweep
    bands = {} if posterior is None else {each.name: each.outer[[0, -1]] for each in posterior.trials}
    bottom = _BOTTOM_IN + _BELOW_IN + 0.14
    width, above, columns = (_NARROW_IN, 0.84, 2) if narrow else (WIDTH_IN, 0.44, 4)
    figure, axes = panel(width, _HEIGHT_IN + above, Margins(left=_LEFT_IN, right=0.06, top=above, bottom=bottom))
    below = add_panel(figure, (_LEFT_IN, _BOTTOM_IN), (width - _LEFT_IN - 0.06, _BELOW_IN))
    sweep = calibration.sweep
    hz, twin = sweep.frequency_hz, sweep.speed_twin
    for part, minus in ((axes, np.zeros_like(twin)), (below, twin)):
        _shade_extrapolated(part, calibration)
        _draw(part, calibration, minus, predicted)
        for trial in calibration.trials:
            at, speed = trial.measured.frequency.hz, trial.measured.speed
            less = float(np.interp(at, hz, minus, left=np.nan, right=np.nan))
            role = trial.measured.role
            label, edge = "filmed, fitted" if role == "fit" else "filmed, held out", INK
            if role != "fit" and (band := bands.get(trial.measured.name)) is not None:
                part.vlines(at, *((band - less) * MM), color=TWIN, linewidth=2.6, alpha=0.55)
                if not band[0] <= speed <= band[1]:
                    label, edge = "held out, outside", GAP
            part.plot(at, (speed - less) * MM, **role_marker(edge, role), label=label)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.tick_params(labelbottom=False)
    axes.set_ylabel("speed (mm/s)")
    below.set(ylabel="minus twin\n(mm/s)", xlabel="tail beat frequency (Hz)")
    legend_above(axes, columns)
    return figure


def _draw(axes: Axes, calibration: Calibration, minus: np.ndarray, predicted: PredictedSweep | None) -> None:
    sweep, trials = calibration.sweep, [t.measured for t in calibration.trials if t.measured.role == "fit"]
    hz = sweep.frequency_hz
    if predicted is not None:
        less = np.interp(predicted.frequency_hz, hz, minus)
        ends = [(predicted.outer[i] - less) * MM for i in (0, -1)]
        axes.fill_between(predicted.frequency_hz, *ends, color=TWIN, alpha=0.16, linewidth=0, label="corrected, 90 %")
        middle = (predicted.outer[2] - less) * MM
        axes.plot(predicted.frequency_hz, middle, color=TWIN, linewidth=0.9, alpha=0.45)
    known = [trial.frequency.hz for trial in trials], [trial.speed for trial in trials]
    for name, look in _RULES.items():
        rule = np.array(BASELINES[name].rule(*known, list(hz)), float)
        axes.plot(hz, (rule - minus) * MM, color=MUTED, linewidth=1.1, label=MODELS[name], **look)
    theory: Look = {"color": EBT, "linewidth": 1.3, "linestyle": (0, (5, 2)), "label": MODELS["ebt_published"]}
    axes.plot(hz, (sweep.speed_ebt - minus) * MM, **theory)
    axes.plot(hz, (sweep.speed_twin - minus) * MM, color=TWIN, linewidth=1.8, label=MODELS["twin"])


def _shade_extrapolated(axes: Axes, calibration: Calibration) -> None:
    sweep = calibration.sweep
    low, high = sweep.fitted_hz
    first, last = float(np.min(sweep.frequency_hz)), float(np.max(sweep.frequency_hz))
    axes.set_xlim(min(first, low), max(last, high))
    for start, end in ((first, low), (high, last)):
        if start < end:
            axes.axvspan(start, end, facecolor=SHADE, linewidth=0)


def build_forecasts(context: ReportContext) -> Section:
    """Build the section: tables of trials and, with held-out trials, of models."""
    calibration = context.calibration
    blocks: list[Block] = [_trials(calibration)]
    if flagged := [(t.measured.name, text) for t in calibration.trials for text in trial_caveats(t)]:
        heads = table_head("trial | flag")
        blocks.append(Table(f"{counted(len(flagged), 'flag')} of single trials.", heads, tuple(flagged), folded=True))
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
    blocks.append(Terms((("c_D / β", _theory(calibration)),), "Elongated body theory as fitted."))
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


def _theory(calibration: Calibration) -> str:
    """State the one identifiable number of each form of the theory, and what it means where one trial gives it."""
    ebts, fitted = calibration.ebts, [each for each in calibration.trials if each.measured.role == "fit"]
    ratios = [f"{significant(e.drag_coefficient / (e.beta or 1.0))} ({model_label(name)})" for name, e in ebts.items()]
    at_bound = [flag.message.removeprefix("EBT: ") for ebt in ebts.values() for flag in ebt.flags]
    caveats = [sentence(text) for text in dict.fromkeys(at_bound) if "identifiable" not in text]
    if len(fitted) == 1:
        caveats.insert(0, "Fitted to one trial, it meets that trial’s speed by construction.")
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
    why = context.unknown_to_bands or ": the bands are too narrow, or the twin lacks an effect"
    forecasts = f"{len(bands)} forecasts of held-out speeds, from the frequency and from two beats,"
    return (f"{missed} of {forecasts} miss by more than their 90 % bands{why}.",)
