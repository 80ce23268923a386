"""The figure of the distance of each trial from its twin, marker by marker."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting import CalibratedTrial
from fitting.forecast import residuals
from reports.colours import INK, SHADE, TWIN, WARN
from reports.numbers import MM, in_words, shortened
from reports.style import FULL_WIDTH_IN, HALF_WIDTH_IN, Grid, Margins, legend_on_top, name_panels, panels, styled

_MOST_COLUMNS = 6  # panels in a row of the page
_IN_HALF = 3  # panels in a row of half the page
TRUSTED = 0.9  # share of a marker's samples below which its bar is marked


@styled
def marker_residuals_figure(trials: Sequence[CalibratedTrial]) -> Figure:
    """Draw the mean distance by marker over the scored window, and that of the shape alone, a panel a trial."""
    rows = max(len(trial.measured.markers) for trial in trials)
    columns = min(len(trials), _MOST_COLUMNS)
    width = HALF_WIDTH_IN if columns <= _IN_HALF else FULL_WIDTH_IN
    figure, drawn = panels(len(trials), Grid(columns, 0.15 + 0.135 * rows), width, Margins(left=0.78, top=0.5))
    distances = [marker_distances(trial) for trial in trials]
    reach = np.nanmax([*(np.nan_to_num(distance).max() for distance, *_ in distances), 1e-3]) * MM
    for axes, trial, columns_of in zip(drawn, trials, distances, strict=True):
        _draw(axes, trial.measured.markers, *columns_of, reach)
        axes.tick_params(length=0, labelsize=6.5)
    name_panels(drawn, [shortened(trial.measured.name, 16) for trial in trials], columns, "mm")
    legend_on_top(figure, 2)
    return figure


def marker_distances(trial: CalibratedTrial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the mean distances by marker over the scored frames of (n, m) samples, flagged ones left out.

    Returns:
        The mean distance in the head frame (m,), m, that of the shape alone (m,), m, and the share of samples that
            count (m,). Means are nan for a marker of which nothing counts.
    """
    measured, simulated, scored = trial.measured, trial.simulated, trial.measured.scored
    distance = np.linalg.norm(residuals(measured, simulated, scored), axis=-1)  # (k, m)
    shape = np.linalg.norm(simulated.shape_m[scored] - measured.head.shape_m[scored], axis=-1)
    good = (measured.weight[scored] > 0) & np.isfinite(distance)
    count = good.sum(axis=0)
    known = np.where(count > 0, count, np.nan)
    means = (np.where(good, values, 0.0).sum(axis=0) / known for values in (distance, shape))
    return (*means, count / max(scored.sum(), 1))


def _draw(
    axes: Axes, markers: tuple[str, ...], distance: np.ndarray, shape: np.ndarray, share: np.ndarray, reach: float
) -> None:
    rows = -np.arange(len(markers))
    axes.barh(rows, 1.3 * reach, height=0.7, color=SHADE)
    axes.barh(rows, distance * MM, height=0.7, color=TWIN, label="mean distance")
    axes.plot(shape * MM, rows, "|", color=INK, markersize=6, markeredgewidth=1.4, label="shape alone")
    for row, used in zip(rows.tolist(), share, strict=True):
        if used < TRUSTED:
            text = f"{used:.0%}".replace("%", " %")
            axes.text(1.28 * reach, row, text, color=WARN, fontsize=6.5, va="center_baseline", ha="right")
    axes.set(xlim=(0.0, 1.3 * reach), ylim=(-len(markers) + 0.4, 0.6))
    axes.set_yticks(rows, [shortened(in_words(name), 11) for name in markers])
    axes.grid(visible=False, axis="y")
    axes.locator_params(axis="x", nbins=3)
