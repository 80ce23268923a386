"""Forecasts of held-out trials by the model and by simple baselines."""

from fitting.model.session_forecast import BEATS, GIVEN, SessionForecast
from reports.blocks import Plot, Plots, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.forecasts import forecasts_figure
from reports.forecast_words import MODELS, is_baseline, mean_speed_errors
from reports.numbers import counted, in_mm, shown, whole_percent

_COLUMNS = table_head(
    "model | speed error [mm/s] | markers as tracked [mm] | relative to the nose [mm] | coordinates in 90 % band []"
)


def build(context: ReportContext) -> Section | None:
    """Nothing without a held-out trial."""
    forecasts = context.calibration.forecasts
    if not forecasts.held_out:
        return None
    plot = Plot(
        forecasts_figure(forecasts),
        "forecast-speeds",
        "Speeds of held-out trials with 90 % bands. Given the frequency: the twin, corrected by its error in the "
        "fitted trials. After two beats: trim, registration and boxes come from the trial's first two beats. A band "
        "that misses the measured speed is too narrow.",
    )
    return Section("Forecasts", "forecasts", (Plots((plot,)), _table(context)), _caveats(context))


def _table(context: ReportContext) -> Table:
    forecasts = context.calibration.forecasts.compared
    rows = []
    for model, error in mean_speed_errors(forecasts).items():
        inside = forecasts.mean(model, "inside")
        rows.append(
            (
                f"{MODELS[model]}{' (baseline)' if is_baseline(model) else ''}",
                in_mm(error),
                shown(forecasts.mean(model, "marker_error_mm")),
                shown(forecasts.mean(model, "shape_error_mm")),
                whole_percent(inside) if inside == inside else shown(None),
            )
        )
    caption = (
        f"Means over {_whose(forecasts, context.calibration.forecasts)}. Alone: without its discrepancy. "
        "Baselines use the fitted speeds and the trial's frequency only; the continuation uses its first two beats "
        "only. EBT uses the measured tail of the whole trial, so it is not a forecast."
    )
    return Table(caption, _COLUMNS, tuple(rows))


def _whose(compared: SessionForecast, forecasts: SessionForecast) -> str:
    """The trials that means are over, the same for all models."""
    all_of_them = counted(len(forecasts.held_out), "held-out trial")
    if len(compared.held_out) == len(forecasts.held_out):
        return all_of_them
    return f"{len(compared.held_out)} of {all_of_them}, those of which every model tells the speed"


def _caveats(context: ReportContext) -> tuple[str, ...]:
    bands = [
        (model, low <= trial.speed_measured <= high)
        for trial in context.calibration.forecasts.held_out
        for model in (GIVEN, BEATS)
        if model in trial.forecasts and (band := trial.forecasts[model].speed_ci90) is not None
        for low, high in [band]
    ]
    missed = sum(not inside for _, inside in bands)
    if missed <= 0.2 * len(bands):
        return ()
    return (f"{missed} of {len(bands)} measured speeds are outside their 90 % bands: the bands are too narrow.",)
