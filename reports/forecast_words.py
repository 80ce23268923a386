"""What the forecasts of held-out trials are worth, in sentences: the model and simple baselines."""

from math import isfinite

from fitting.ebt import FORMS
from fitting.model.session_forecast import BASELINES, BEATS, CONTINUED, GIVEN, TWIN, SessionForecast
from reports.models import model_label
from reports.numbers import in_mm, shown, spanned

MODELS = {
    TWIN: "twin alone",
    GIVEN: "twin with discrepancy",
    BEATS: "that after two beats",
    CONTINUED: "goes on as in two beats",
    "line": "line in frequency",
    "power_law": "power law in frequency",
    "constant_stride": "constant stride",
    **{f"ebt_{form.name}": model_label(form.name) for form in FORMS},
}
"""The models of `ForecastTrial.forecasts` as the reader meets them, in their order."""


def beaten(forecasts: SessionForecast) -> bool:
    """Whether speeds forecast from the command are better than every simple baseline, on average."""
    best = forecasts.best_baseline
    return bool(best) and forecasts.gain(GIVEN, best).mean > 0


def speed_sentence(forecasts: SessionForecast) -> str:
    """How well held-out speeds are forecast given the frequency, and whether that is better than the best baseline."""
    if not forecasts.held_out:
        return "No trial is held out: how well the twin forecasts is not known."
    own, best = in_mm(forecasts.mean(GIVEN, "speed_error")), forecasts.best_baseline
    text = f"Mean speed error of held-out trials, given their frequency: twin with learned discrepancy {own} mm/s"
    if not best:
        return f"{text}; no baseline can be drawn through the fitted speeds."
    gain = forecasts.gain(GIVEN, best)
    ends = "" if gain.interval is None else f", 90 % interval over trials {spanned(*gain.interval, in_mm)}"
    sure = gain.interval is not None and gain.interval[0] > 0
    how = "is not better" if not gain.mean > 0 else "is better" if sure else "is better, but not significantly"
    return (
        f"{text}, best baseline ({MODELS[best]}) {in_mm(forecasts.mean(best, 'speed_error'))} mm/s. The twin {how} "
        f"(gain {in_mm(gain.mean)} mm/s{ends})."
    )


def marker_sentence(forecasts: SessionForecast) -> str:
    """How well held-out markers are forecast after two beats, and by going on as in these; empty where unknown."""
    values = {
        model: (forecasts.mean(model, "marker_error_mm"), forecasts.mean(model, "shape_error_mm"))
        for model in (BEATS, CONTINUED)
    }
    if not all(isfinite(each) for pair in values.values() for each in pair):
        return ""
    (path, shape), (goes_on, goes_on_shape) = values[BEATS], values[CONTINUED]
    how = "better" if path < goes_on else "not better"
    return (
        f"Mean marker error of held-out trials after two beats: twin {shown(path)} mm ({shown(shape)} relative to the "
        f"nose), baseline ({MODELS[CONTINUED]}) {shown(goes_on)} mm ({shown(goes_on_shape)}). The twin is {how}."
    )


def mean_speed_errors(forecasts: SessionForecast) -> dict[str, float]:
    """Mean absolute error over the held-out trials by model, m/s, as far as it is known."""
    errors = {name: forecasts.mean(name, "speed_error") for name in MODELS}
    return {name: error for name, error in errors.items() if isfinite(error)}


def is_baseline(model: str) -> bool:
    """Whether a first-year student would try it."""
    return model in BASELINES or model == CONTINUED
