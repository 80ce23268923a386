"""Where the coefficients ended, and where the other starts did."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting import CoefficientFit
from reports.figures.coefficient_scale import HIGH, LOW, NAMES, scale_by_root
from reports.style import HALF_WIDTH_IN, INK, MUTED, SHADE, TWIN, WARN, Margins, legend_above, panel, styled
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients


@styled
def coefficients_figure(fit: CoefficientFit) -> Figure:
    """Each coefficient within its bounds, on the square-root scale of the search; dots are ends."""
    figure, axes = panel(HALF_WIDTH_IN, 3.3, Margins(left=1.0, top=0.5))
    rows = -np.arange(len(fit.coefficients))
    axes.barh(rows, HIGH - LOW, left=LOW, height=0.5, color=SHADE)
    for restart in fit.restarts[1:]:
        mark = "o" if restart.swims_forward else "x"
        axes.plot(np.sqrt(restart.coefficients), rows, mark, color=MUTED, markersize=3.5, alpha=0.7)
    axes.plot(np.sqrt(PUBLISHED_COEFFICIENTS), rows, "|", color=INK, markersize=11, markeredgewidth=1.6)
    best = np.sqrt(fit.coefficients)
    bound = coefficients_at_bound(fit)
    axes.plot(best[~bound], rows[~bound], "D", color=TWIN, markersize=6)
    axes.plot(best[bound], rows[bound], "D", color=WARN, markersize=6)
    _dress(axes, rows)
    _legend(axes, bool(bound.any()), any(not restart.swims_forward for restart in fit.restarts[1:]))
    return figure


def coefficients_at_bound(fit: CoefficientFit) -> np.ndarray:
    """(5,) True where a flag says that the coefficient lies at its bound."""
    messages = [flag.message for flag in fit.flags if flag.kind == "at_bound"]
    return np.array([any(name in message for message in messages) for name in FluidCoefficients._fields])


def _legend(axes: Axes, any_at_bound: bool, any_backward: bool) -> None:
    axes.plot([], [], "D", color=TWIN, label="best")
    if any_at_bound:
        axes.plot([], [], "D", color=WARN, label="best, at its bound")
    axes.plot([], [], "|", color=INK, markersize=9, markeredgewidth=1.6, label="published")
    axes.plot([], [], "o", color=MUTED, markersize=3.5, label="other starts")
    if any_backward:
        axes.plot([], [], "x", color=MUTED, markersize=3.5, label="backward")
    legend_above(axes, 3, columnspacing=1.0, handletextpad=0.3)


def _dress(axes: Axes, rows: np.ndarray) -> None:
    axes.set_yticks(rows, NAMES)
    axes.set_xlabel("coefficient (no unit; square-root scale)")
    axes.grid(visible=False, axis="y")
    scale_by_root(axes)
