"""How the objective rises along each coefficient."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting import CoefficientProfiles
from reports.figures.coefficient_scale import NAMES, scale_by_root
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, MUTED, TWIN, Grid, Margins, legend_on_top, panels, styled
from swimmer import FluidCoefficients

_HIGHEST = 2.0  # times the best distance, where a panel ends


@styled
def coefficient_profiles_figure(profiles: CoefficientProfiles, best: FluidCoefficients) -> Figure:
    """A panel for each coefficient, all to one scale: all else held, all else following, and where restarts ended."""
    figure, drawn = panels(len(NAMES), Grid(2, 0.66, gap_in=(0.2, 0.34)), HALF_WIDTH_IN, Margins(left=0.5, top=0.5))
    lowest = np.nanmin(profiles.profile_m, initial=profiles.best_m) * MM
    limits = (0.95 * lowest, _HIGHEST * profiles.best_m * MM)
    for i, (axes, name) in enumerate(zip(drawn, NAMES, strict=True)):
        at = np.searchsorted(profiles.value[i], best[i])  # both curves pass through the fit
        root = np.sqrt(np.insert(profiles.value[i], at, best[i]))
        held = np.insert(profiles.slice_m[i], at, profiles.best_m)
        value, follows = profiles.curve(i, best[i])
        axes.plot(root, held * MM, color=MUTED, linewidth=0.9, linestyle=(0, (3, 2)))
        axes.plot(np.sqrt(value), follows * MM, color=TWIN, linewidth=1.4)
        axes.plot(np.sqrt(profiles.restart[:, i]), profiles.restart_m * MM, "o", color=MUTED, markersize=3)
        axes.plot(np.sqrt(best[i]), profiles.best_m * MM, "D", color=TWIN, markersize=4.5)
        _dress(axes, limits, labels=(i % 2 == 0, i + 2 >= len(NAMES)))
        axes.set_title(name, loc="left", pad=2)
    drawn[2].set_ylabel("mean marker distance (mm)")
    drawn[-1].set_xlabel("coefficient (square-root scale)")
    handles = [
        Line2D([], [], color=TWIN, label="all else follows"),
        Line2D([], [], color=MUTED, linewidth=0.9, linestyle=(0, (3, 2)), label="all else held"),
        Line2D([], [], color=TWIN, marker="D", markersize=4.5, linestyle="none", label="fit"),
        Line2D([], [], color=MUTED, marker="o", markersize=3, linestyle="none", label="other starts"),
    ]
    legend_on_top(figure, handles, 2)
    return figure


def _dress(axes: Axes, limits: tuple[float, float], labels: tuple[bool, bool]) -> None:
    scale_by_root(axes, ticks=(0.0, 0.5, 2.0, 5.0, 10.0))
    axes.set_ylim(*limits)
    axes.locator_params(axis="y", nbins=4)
    axes.tick_params(labelleft=labels[0], labelbottom=labels[1])
