"""How far each marker of each trial is from the twin's."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fitting import CalibratedTrial, residuals
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, INK, SHADE, TWIN, WARN, Grid, Margins, legend_on_top, panels, styled

MOST_COLUMNS = 3
TRUSTED = 0.9  # share of a marker's samples below which its bar is marked


@styled
def marker_residuals_figure(trials: Sequence[CalibratedTrial]) -> Figure:
    """A panel for each trial: mean distance by marker over the scored window, and that of the shape alone."""
    rows = max(len(trial.measured.markers) for trial in trials)
    columns = min(len(trials), MOST_COLUMNS)
    figure, drawn = panels(len(trials), Grid(columns, 0.15 + 0.135 * rows), HALF_WIDTH_IN, Margins(left=0.78, top=0.5))
    distances = [marker_distances(trial) for trial in trials]
    reach = np.nanmax([*(np.nan_to_num(distance).max() for distance, *_ in distances), 1e-3]) * MM
    for number, (axes, trial, columns_of) in enumerate(zip(drawn, trials, distances, strict=True)):
        _draw(axes, trial.measured.markers, *columns_of, reach)
        axes.set_title(shortened(trial.measured.name, 16), loc="left", fontweight="bold", pad=3)
        axes.tick_params(labelleft=number % columns == 0, length=0, labelsize=6.5)
        axes.tick_params(axis="x", labelbottom=number + columns >= len(trials))
        if number + columns >= len(trials):
            axes.set_xlabel("mm")
    _legend(figure)
    return figure


def marker_distances(trial: CalibratedTrial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(m,) each over the scored frames of (n, m) samples, flagged ones left out.

    Returns:
        Mean distance in the head frame (m), that of the shape alone (m), share of samples that count. Means are
        nan for a marker of which nothing counts.
    """
    measured, frames = trial.measured, trial.measured.scored
    distance = np.linalg.norm(residuals(measured, trial.simulated, frames), axis=-1)  # (k, m)
    shape = np.linalg.norm(trial.simulated.shape_m[frames] - measured.head.shape_m[frames], axis=-1)
    good = (measured.weight[frames] > 0) & np.isfinite(distance)
    count = good.sum(axis=0)
    per_marker = np.where(count > 0, count, np.nan)
    means = (np.where(good, values, 0.0).sum(axis=0) / per_marker for values in (distance, shape))
    return (*means, count / max(len(good), 1))


def _draw(
    axes: Axes, markers: tuple[str, ...], distance: np.ndarray, shape: np.ndarray, share: np.ndarray, reach: float
) -> None:
    rows = -np.arange(len(markers))
    axes.barh(rows, 1.3 * reach, height=0.7, color=SHADE)
    axes.barh(rows, distance * MM, height=0.7, color=TWIN)
    axes.plot(shape * MM, rows, "|", color=INK, markersize=6, markeredgewidth=1.4)
    for row, used in zip(rows.tolist(), share, strict=True):
        if used < TRUSTED:
            text = f"{used:.0%}".replace("%", " %")
            axes.text(1.28 * reach, row, text, color=WARN, fontsize=6.5, va="center_baseline", ha="right")
    axes.set(xlim=(0.0, 1.3 * reach), ylim=(-len(markers) + 0.4, 0.6))
    axes.set_yticks(rows, [shortened(name.replace("_", " "), 11) for name in markers])
    axes.grid(visible=False, axis="y")
    axes.locator_params(axis="x", nbins=3)


def _legend(figure: Figure) -> None:
    tick = {"marker": "|", "markersize": 7, "markeredgewidth": 1.4, "linestyle": "none"}
    shape = Line2D([], [], color=INK, label="shape alone", **tick)  # type: ignore[arg-type]
    legend_on_top(figure, [Patch(color=TWIN, label="mean distance"), shape], 2)
