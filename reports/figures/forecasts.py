"""The figure of held-out speeds, measured and forecast."""

import numpy as np
from matplotlib.figure import Figure

from fitting.model.session_forecast import BEATS, GIVEN, SessionForecast
from reports.colours import EBT, INK, MUTED, TWIN
from reports.forecast_words import MODELS
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, Look, Margins, legend_above, panel, styled

_SHIFT = 0.17  # distance of a model from the middle of its row, in rows


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
