"""How far off each trial's predicted speed is."""

from matplotlib.figure import Figure

from fitting import Calibration
from reports.figures.role_marker import role_marker
from reports.models import model_colour, model_label
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, INK, Margins, legend_above, panel, styled

_SHOWN = {"twin": 0.22, "published": 0.0, "large": -0.22}  # models, and how far above their row


@styled
def speed_errors_figure(calibration: Calibration) -> Figure:
    """Predicted minus measured speed, a row for each trial, fastest on top; open marks were held out."""
    trials = sorted(calibration.trials, key=lambda trial: trial.measured.frequency.hz)
    count = len(trials)
    height = min(max(1.1 + 0.52 * count, 2.2), 3.7) if count < 10 else 1.2 + 0.25 * count
    figure, axes = panel(HALF_WIDTH_IN, height, Margins(left=1.05, top=0.52))
    axes.axvline(0.0, color=INK, linewidth=0.8)
    for row, trial in enumerate(trials):
        speeds = trial.speeds
        for name, shift in _SHOWN.items():
            colour, error = model_colour(name), (speeds[name] - trial.measured.speed) * MM
            axes.plot([0.0, error], [row + shift] * 2, color=colour, linewidth=1.2)
            axes.plot(error, row + shift, **role_marker(colour, trial.measured.role))
    for name in _SHOWN:
        axes.plot([], [], color=model_colour(name), marker="s", markersize=4.5, label=model_label(name))
    axes.set_yticks(range(count), [shortened(trial.measured.name) for trial in trials])
    axes.set_ylim(-0.6, count - 0.4)
    axes.set_xlabel("predicted minus measured speed (mm/s)")
    legend_above(axes, 2)
    return figure
