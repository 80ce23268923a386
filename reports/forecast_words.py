"""What the forecasts of held-out trials are worth, in sentences: the model and simple baselines."""

from math import isfinite, nan

from fitting.ebt import FORMS
from fitting.model.session_forecast import BASELINES, BEATS, CONTINUED, DRAWN, GIVEN, TWIN, SessionForecast
from reports.models import model_label
from reports.numbers import counted, in_mm, shown, spanned

MODELS = {
    TWIN: "twin alone",
    GIVEN: "twin, given the frequency",
    DRAWN: "twin, given the frequency, averaged over the posterior",
    BEATS: "twin, after two beats",
    CONTINUED: "continuation of two beats",
    "line": "line in frequency",
    "power_law": "power law in frequency",
    "constant_stride": "constant stride",
    **{f"ebt_{form.name}": model_label(form.name) for form in FORMS},
}
"""The models of `ForecastTrial.forecasts` as the reader meets them, in their order."""


_MISSED = 0.1
"""Relative error of a fit trial's speed, from which the twin does not describe the robot."""


def misses(forecasts: SessionForecast) -> str:
    """Say by how much the twin misses the fit trial it misses most, where that is more than 10 %; else nothing."""
    off = {
        name: trial.forecasts[TWIN].speed / trial.speed_measured - 1
        for name, trial in forecasts.trials.items()
        if trial.role == "fit" and TWIN in trial.forecasts and trial.speed_measured
    }
    worst = max(off, key=lambda name: abs(off[name]), default="")
    if not worst or abs(off[worst]) <= _MISSED:
        return ""
    measured, twin = forecasts.trials[worst].speed_measured, forecasts.trials[worst].forecasts[TWIN].speed
    way = f"{100 * abs(off[worst]):.0f} % too {'fast' if off[worst] > 0 else 'slow'}"
    way = "going the other way" if measured * twin < 0 else way
    return (
        f"The twin does not describe this robot: in {worst}, which it was fitted to, it is {way} ({in_mm(twin)} "
        f"instead of {in_mm(measured)} mm/s)."
    )


def twin_sentence(forecasts: SessionForecast) -> str:
    """How far the exported twin, without any correction, is off in fit and in held-out trials; empty where unknown."""
    parts = []
    for role, words in (("fit", "fit trial"), ("holdout", "held-out trial")):
        own = [trial for trial in forecasts.trials.values() if trial.role == role and TWIN in trial.forecasts]
        if own:
            speed = sum(abs(trial.forecasts[TWIN].speed - trial.speed_measured) for trial in own) / len(own)
            errors = [trial.forecasts[TWIN].marker_error_mm for trial in own]
            markers = sum(nan if error is None else error for error in errors) / len(own)
            parts.append(f"{in_mm(speed)} mm/s and {shown(markers)} mm in {counted(len(own), words)}")
    off = f"The exported twin is off by {' and by '.join(parts)}." if parts else ""
    return " ".join(filter(None, (misses(forecasts), off)))


def beaten(forecasts: SessionForecast) -> bool:
    """Whether speeds forecast given the frequency are better than every simple baseline, on average."""
    best = forecasts.best_baseline
    return bool(best) and forecasts.gain(GIVEN, best).mean > 0


def speed_sentence(forecasts: SessionForecast) -> str:
    """How well held-out speeds are forecast given the frequency, and by the best baseline."""
    if not forecasts.held_out:
        return "No trial is held out: how well the twin forecasts is not known."
    own, alone = (in_mm(forecasts.mean(model, "speed_error")) for model in (GIVEN, TWIN))
    text = f"Held-out speed error: twin {alone} mm/s, with the correction that the fit trials show {own} mm/s"
    if not (best := forecasts.best_baseline):
        return f"{text}; no baseline can be drawn through the fitted speeds."
    return f"{text}; {MODELS[best]} {in_mm(forecasts.mean(best, 'speed_error'))} mm/s."


def drawn_sentence(forecasts: SessionForecast) -> str:
    """How well held-out speeds are forecast by the draws of a posterior, and by the best baseline; empty without."""
    if not (best := forecasts.best_baseline):
        return ""
    own, other = (in_mm(forecasts.mean(model, "speed_error")) for model in (DRAWN, best))
    errors = f"twin {own} mm/s; {MODELS[best]} {other} mm/s"
    return f"Held-out speed error, averaged over the draws: {errors}. {gain_sentence(forecasts, DRAWN)}"


def gain_sentence(forecasts: SessionForecast, model: str = GIVEN) -> str:
    """Whether that is better than the best baseline; empty where there is none."""
    if not (best := forecasts.best_baseline):
        return ""
    gain = forecasts.gain(model, best)
    ends = "" if gain.interval is None else f", 90 % interval over trials {spanned(*gain.interval, in_mm)}"
    sure = gain.interval is not None and gain.interval[0] > 0
    how = "not better than the best baseline"
    if gain.mean > 0:
        how = f"better than the best baseline{'' if sure else ', but not significantly'}"
    return f"With it the twin is {how}: gain {in_mm(gain.mean)} mm/s{ends}."


def marker_sentence(forecasts: SessionForecast) -> str:
    """How well held-out markers are forecast after two beats, and by going on as in these; empty where unknown."""
    own, goes_on = (forecasts.mean(model, "marker_error_mm") for model in (BEATS, CONTINUED))
    if not (isfinite(own) and isfinite(goes_on)):
        return ""
    return (
        f"Held-out marker error, after two beats: twin {shown(own)} mm; {MODELS[CONTINUED]} {shown(goes_on)} mm. "
        f"The twin is {'better' if own < goes_on else 'not better'}."
    )


def mean_speed_errors(forecasts: SessionForecast) -> dict[str, float]:
    """Mean absolute error over the held-out trials by model, m/s, as far as it is known."""
    errors = {name: forecasts.mean(name, "speed_error") for name in MODELS}
    return {name: error for name, error in errors.items() if isfinite(error)}


def is_baseline(model: str) -> bool:
    """Whether a first-year student would try it."""
    return model in BASELINES or model == CONTINUED
