"""How each start of the search went."""

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fitting import CoefficientFit
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, MUTED, TWIN, Margins, legend_above, panel, styled


@styled
def convergence_figure(fit: CoefficientFit) -> Figure:
    """The softened mean distance after each iteration; filled ends converged, open ones were stopped."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    for rank, restart in reversed(list(enumerate(fit.restarts))):
        colour, width = (TWIN, 1.8) if rank == 0 else (MUTED, 0.9)
        history, line = restart.history_m * MM, "-" if restart.swims_forward else ":"
        alpha = 1.0 if rank == 0 else 0.7
        axes.plot(history, line, color=colour, linewidth=width, alpha=alpha)
        face = colour if restart.converged else "none"
        axes.plot(len(history) - 1, history[-1], "o", color=colour, markerfacecolor=face, markersize=4.5)
    axes.plot([], [], "-o", color=TWIN, markersize=4.5, label="best")
    axes.plot([], [], "-o", color=MUTED, markersize=4.5, label="converged")
    axes.plot([], [], "-o", color=MUTED, markerfacecolor="none", markersize=4.5, label="stopped early")
    if any(not restart.swims_forward for restart in fit.restarts):
        axes.plot([], [], ":", color=MUTED, linewidth=0.9, label="backward")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("iteration")
    axes.set_ylabel("objective (mm)")
    legend_above(axes, 2)
    return figure
