"""How fast a search finds good coefficients: the best so far over what was simulated."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from reports.colours import EBT, MUTED, TWIN
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, Margins, legend_above, panel, styled

Trace = Sequence[tuple[float, float]]
"""(simulated seconds, best mean distance so far in m) at every new best."""

_COLOURS = {"gradient": TWIN, "bo-nm": EBT}
_DASHES = {"gradient": "-", "bo-nm": (0, (5, 1.5))}
_WORST = 1.5  # times the best distance of all, where the panel ends
_DECADES = 1.5  # of simulated time from which ticks are one a decade


@styled
def search_convergence_figure(
    searches: Mapping[str, Sequence[tuple[Trace, float]]], labels: Mapping[str, str]
) -> Figure:
    """Steps down to the end of each search, one line a seed.

    Args:
        searches: by method, the trace and the simulated seconds in all of each seed; those without a trace found
            nothing.
        labels: of the methods.
    """
    figure, axes = panel(HALF_WIDTH_IN, 3.3, Margins(top=0.5))
    for method, of_seeds in searches.items():
        for trace, spent_s in of_seeds:
            if trace:
                _draw(axes, method, np.array(trace), spent_s)
        style = {"color": _COLOURS.get(method, MUTED), "linestyle": _DASHES.get(method, "-")}
        axes.plot([], [], label=labels.get(method, method), **style)  # type: ignore[arg-type]
    best = min((trace[-1][1] for of_seeds in searches.values() for trace, _ in of_seeds if trace), default=0.0) * MM
    axes.set_xscale("log")
    if best:
        axes.set_ylim(0.96 * best, min(1.02 * axes.get_ylim()[1], _WORST * best))
    first, last = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if last > 10**_DECADES * first else (1.0, 2.0, 5.0)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _position: f"{value:,.0f}".replace(",", " ")))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlabel("simulated time (s)")
    axes.set_ylabel("best mean marker distance (mm)")
    legend_above(axes, 2)
    return figure


def _draw(axes: Axes, method: str, trace: np.ndarray, spent_s: float) -> None:
    """Steps of (k, 2), held to the end of the search; the marker is where it ended."""
    time_s = np.append(trace[:, 0], max(spent_s, trace[-1, 0]))
    value = np.append(trace[:, 1], trace[-1, 1]) * MM
    colour = _COLOURS.get(method, MUTED)
    axes.plot(time_s, value, color=colour, linestyle=_DASHES.get(method, "-"), drawstyle="steps-post", linewidth=1.3)
    axes.plot(time_s[-1], value[-1], "o", color=colour, markersize=3.5)
