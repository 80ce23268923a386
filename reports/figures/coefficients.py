"""The figure of the coefficients between their bounds."""

import numpy as np
from matplotlib.figure import Figure

from fitting import CoefficientFit
from reports.colours import EBT, INK, MUTED, SHADE, TWIN, WARN
from reports.numbers import in_words
from reports.style import HALF_WIDTH_IN, Look, Margins, legend_above, panel, styled
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients
from swimmer.fluid import COEFFICIENT_BOUNDS

NAMES = tuple(map(in_words, FluidCoefficients._fields))
_LOW = float(np.sqrt(COEFFICIENT_BOUNDS[0]))
_HIGH = float(np.sqrt(COEFFICIENT_BOUNDS[1]))
_TICKS = (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0)


@styled
def coefficients_figure(fit: CoefficientFit, published: FluidCoefficients | None = None) -> Figure:
    """Draw each coefficient within its bounds, on the square-root scale, with its 90 % interval.

    Dots are other ends.
    """
    figure, axes = panel(HALF_WIDTH_IN, 3.3, Margins(left=1.0, top=0.5))
    rows = -np.arange(len(NAMES))
    axes.barh(rows, _HIGH - _LOW, left=_LOW, height=0.5, color=SHADE)
    axes.set_yticks(rows, NAMES)
    axes.set(xlabel="coefficient (no unit; square-root scale)", xlim=(_LOW - 0.08, _HIGH + 0.08))
    axes.grid(visible=False, axis="y")
    within = [tick for tick in _TICKS if _LOW <= np.sqrt(tick) <= _HIGH]
    axes.set_xticks(np.sqrt(within), [f"{tick:g}" for tick in within])
    best, bound = np.sqrt(fit.coefficients), coefficients_at_bound(fit)
    for row, ends in zip(rows, np.sqrt(fit.interval), strict=True):
        axes.plot(ends, [row] * 2, color=TWIN, linewidth=2.0, zorder=2.6)
    for chosen, colour, label in ((~bound, TWIN, "mode"), (bound, WARN, "at its bound")):
        if chosen.any():
            axes.plot(best[chosen], rows[chosen], "D", color=colour, markersize=6, label=label, zorder=3)
    if published is not None:
        look: Look = {"color": EBT, "markersize": 6, "markerfacecolor": "none", "label": "published"}
        axes.plot(np.sqrt(published), rows, "s", **look)
    authors: Look = {"markersize": 11, "markeredgewidth": 1.6, "zorder": 2.5, "label": "authors"}
    axes.plot(np.sqrt(PUBLISHED_COEFFICIENTS), rows, "|", color=INK, **authors)
    for end in fit.ends[1:]:
        mark, label = ("o", "other starts") if end.forward else ("x", "backward")
        axes.plot(np.sqrt(end.coefficients), rows, mark, color=MUTED, markersize=3.5, alpha=0.7, label=label)
    legend_above(axes, 3, columnspacing=1.0, handletextpad=0.3)
    return figure


def coefficients_at_bound(fit: CoefficientFit) -> np.ndarray:
    """Mark (5,) the coefficients that a flag puts at their bound."""
    messages = [flag.message for flag in fit.flags if flag.kind == "at_bound"]
    return np.array([any(name in message for message in messages) for name in FluidCoefficients._fields])
