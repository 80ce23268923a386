"""Sentences on what the forecasts of held-out trials are worth: the model and simple baselines."""

from math import isfinite

from fitting.ebt import FORMS
from fitting.model.session_forecast import BASELINES, BEATS, CONTINUED, DRAWN, GIVEN, TWIN, SessionForecast
from reports.models import model_label
from reports.numbers import in_mm, spanned

MODELS = {
    TWIN: "exported twin",
    GIVEN: "corrected twin",
    DRAWN: "corrected twin, averaged over the posterior",
    BEATS: "corrected twin, after two beats",
    CONTINUED: "continuation of two beats",
    "line": "line in frequency",
    "power_law": "power law in frequency",
    "constant_stride": "constant stride",
    **{f"ebt_{form.name}": model_label(form.name) for form in FORMS},
    "ebt_published": "elongated body theory",
}
"""The models of `ForecastTrial.forecasts` as the reader meets them, in their order."""


_MISSED = 0.1
"""Largest relative error of a fit trial's speed with which the twin still describes the robot."""


def misses(forecasts: SessionForecast) -> str:
    """Say by how much the twin misses the fit trial it misses most, where that is more than 10 %; else nothing."""
    off = {
        name: trial.forecasts[TWIN].speed / trial.speed_measured - 1
        for name, trial in forecasts.trials.items()
        if trial.role == "fit" and TWIN in trial.forecasts and trial.speed_measured
        if isfinite(trial.forecasts[TWIN].speed)
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


def beaten(forecasts: SessionForecast, model: str = TWIN) -> bool:
    """Return whether a model, by default the exported twin, forecasts speeds better than every simple rule
    on average.
    """
    best = forecasts.best_baseline
    return bool(best) and forecasts.gain(model, best).mean > 0


def compared_with_best(forecasts: SessionForecast, model: str = TWIN) -> str:
    """Say whether a model, by default the exported twin, is better than the best simple rule; empty without a rule.

    The four cases: better; better, but not significantly; worse, but not significantly; worse.
    """
    if not (best := forecasts.best_baseline):
        return ""
    gain, name = forecasts.gain(model, best), MODELS[best]
    if not isfinite(gain.mean):
        return ""
    how = "better" if gain.mean > 0 else "worse"
    sure = gain.interval is not None and gain.interval[0] * gain.interval[1] > 0
    ends = "" if gain.interval is None else f" (90 % interval {spanned(*gain.interval, in_mm)})"
    return (
        f"The twin is {how}{'' if sure else ', but not significantly,'} than the best simple rule, {name}: gain "
        f"{in_mm(gain.mean)} mm/s{ends}."
    )


def correction_sentence(forecasts: SessionForecast, model: str = GIVEN) -> str:
    """Say what held-out speeds gain by the correction that the fit trials suggest.

    The correction is no part of the exported twin.
    """
    own, alone = (in_mm(forecasts.mean(name, "speed_error")) for name in (model, TWIN))
    if not isfinite(forecasts.mean(model, "speed_error")):
        return ""
    return (
        f"With a correction interpolated from the fit trials, which is no part of the exported twin, the speed error "
        f"is {own} instead of {alone} mm/s."
    )


def drawn_sentence(forecasts: SessionForecast) -> str:
    """Say how well the draws of a posterior, and the best simple rule, forecast held-out speeds.

    Empty without a rule.
    """
    if not (best := forecasts.best_baseline):
        return ""
    own, other = (in_mm(forecasts.mean(model, "speed_error")) for model in (DRAWN, best))
    return f"Held-out speed error: corrected twin, averaged over the draws, {own} mm/s; {MODELS[best]} {other} mm/s."


def mean_speed_errors(forecasts: SessionForecast) -> dict[str, float]:
    """Compute the mean absolute error over the held-out trials by model, m/s, as far as it is known."""
    errors = {name: forecasts.mean(name, "speed_error") for name in MODELS}
    return {name: error for name, error in errors.items() if isfinite(error)}


def is_baseline(model: str) -> bool:
    """Return whether a model is a simple baseline, which a first-year student would try."""
    return model in BASELINES or model == CONTINUED
