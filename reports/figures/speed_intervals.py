"""The speed error of every model with its interval, over the fit and over the held-out trials."""

from collections.abc import Mapping
from typing import Literal

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import SpeedErrors
from reports.figures.role_marker import role_marker
from reports.models import model_colour, model_label
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, INK, MUTED, Margins, legend_above, panel, styled

Measure = Literal["mean_absolute", "bias", "worst"]
_AXIS: dict[Measure, str] = {
    "mean_absolute": "mean absolute speed error (mm/s)",
    "bias": "bias of the speed (mm/s)",
    "worst": "largest absolute speed error (mm/s)",
}


@styled
def speed_intervals_figure(errors: Mapping[str, Mapping[str, SpeedErrors]], measure: Measure) -> Figure:
    """A row for each model; bars are 90 % intervals.

    Args:
        errors: by role ("fit", "holdout"), what `fitting.speed_errors` gives.
        measure: which of its three numbers.
    """
    names = list(dict.fromkeys(name for of_role in errors.values() for name in of_role))
    figure, axes = panel(HALF_WIDTH_IN, 1.0 + 0.3 * max(len(names), 2), Margins(left=1.72))
    axes.axvline(0.0, color=INK, linewidth=0.8)
    for shift, (role, of_role) in zip((0.14, -0.14), errors.items(), strict=False):
        for row, name in enumerate(reversed(names)):
            value, low, high = (limit * MM for limit in getattr(of_role[name], measure))
            colour = model_colour(name)
            axes.plot([low, high], [row + shift] * 2, color=colour, linewidth=1.3)
            axes.plot(value, row + shift, **role_marker(colour, role))
    axes.set_yticks(range(len(names)), [model_label(name).replace(" (", "\n(") for name in reversed(names)])
    axes.tick_params(axis="y", labelsize=7, length=0)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlabel(_AXIS[measure])
    roles = (("fit", "fit trials"), ("holdout", "held-out trials"))
    handles = [Line2D([], [], label=text, **role_marker(MUTED, role)) for role, text in roles if role in errors]
    legend_above(axes, 2, handles=handles)
    return figure
