"""How far off each trial's predicted speed is."""

from matplotlib.figure import Figure

from fitting import Calibration
from reports.figures.role_marker import role_marker
from reports.numbers import MM, shortened
from reports.style import EBT, HALF_WIDTH_IN, INK, TWIN, Margins, legend_above, panel, styled


@styled
def speed_errors_figure(calibration: Calibration) -> Figure:
    """Predicted minus measured speed, a row for each trial, fastest on top; open marks were held out."""
    trials = sorted(calibration.trials, key=lambda trial: trial.measured.frequency.hz)
    count = len(trials)
    height = min(max(0.9 + 0.52 * count, 2.0), 3.5) if count < 10 else 1.0 + 0.25 * count
    figure, axes = panel(HALF_WIDTH_IN, height, Margins(left=1.05))
    axes.axvline(0.0, color=INK, linewidth=0.8)
    for row, trial in enumerate(trials):
        for speed, colour in ((trial.speed_ebt, EBT), (trial.speed_twin, TWIN)):
            error = (speed - trial.measured.speed) * MM
            axes.plot([0.0, error], [row, row], color=colour, linewidth=1.2)
            axes.plot(error, row, **role_marker(colour, trial.measured.role))
    for colour, name in ((TWIN, "twin"), (EBT, "elongated body theory")):
        axes.plot([], [], color=colour, marker="s", markersize=4.5, label=name)
    axes.set_yticks(range(count), [shortened(trial.measured.name) for trial in trials])
    axes.set_ylim(-0.6, count - 0.4)
    axes.set_xlabel("predicted minus measured speed (mm/s)")
    legend_above(axes, 2)
    return figure
