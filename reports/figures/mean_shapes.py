"""Where markers are in the mean, trial by trial: measured, the twin's, and the twin's with boxes put right."""

import numpy as np
from matplotlib.figure import Figure

from fitting import CalibratedTrial
from fitting.placed_fit import PlacedFit
from fitting.placement import Placement
from fitting.speed import whole_beats
from reports.colours import FAINT, INK, SURFACE, TWIN
from reports.numbers import MM
from reports.style import FULL_WIDTH_IN, Grid, Look, Margins, legend_on_top, name_panels, panels, styled

_MARGINS = Margins(left=0.55, bottom=0.40, top=0.52)
_COLUMNS = 3


@styled
def mean_shapes_figure(trials: tuple[CalibratedTrial, ...], placed: PlacedFit) -> Figure:
    """A panel a trial, to scale along and across alike; the nose is at 0."""
    shapes = [_means(trial, placed) for trial in trials]
    both = np.concatenate([np.concatenate(three) for three in shapes])
    left, right = float(np.nanmin(both[:, 0])) - 25, float(np.nanmax(both[:, 0])) + 25
    reach = max(1.2 * float(np.nanmax(np.abs(both[:, 1]))), 70.0)
    columns = min(len(trials), _COLUMNS)
    width = (FULL_WIDTH_IN - _MARGINS.left - _MARGINS.right - 0.14 * (columns - 1)) / columns
    grid = Grid(columns, width * 2 * reach / (right - left))
    figure, drawn = panels(len(trials), grid, FULL_WIDTH_IN, _MARGINS)
    for axes, (measured, plain, seen) in zip(drawn, shapes, strict=True):
        axes.axhline(0.0, color=FAINT, linewidth=0.7, zorder=0)
        rings: Look = {"markerfacecolor": SURFACE, "linewidth": 0.9, "markersize": 4.5}
        axes.plot(*plain.T, "o--", color=TWIN, label="twin", **rings)
        axes.plot(*seen.T, "o-", color=TWIN, linewidth=1.1, markersize=4.5, label="twin, boxes and markers put right")
        axes.plot(*measured.T, "o", color=INK, markersize=4, label="measured")
        axes.set(xlim=(left, right), ylim=(-reach, reach))
    roles = {"fit": "fit", "holdout": "held out"}
    names = [f"{trial.measured.name}, {roles[trial.measured.role]}" for trial in trials]
    name_panels(drawn, names, columns, "behind the nose (mm)", "across (mm)")
    legend_on_top(figure, 3)
    return figure


def _means(trial: CalibratedTrial, placed: PlacedFit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(m, 2) mm each, in the order of their places along the twin; over whole beats of the scored frames."""
    measured = trial.measured
    frames = whole_beats(measured.time_s, measured.scored, measured.frequency.hz)
    good = (measured.weight[frames] > 0)[..., None] & np.isfinite(measured.head.shape_m[frames])
    own = next(each for each in placed.trials if each.name == measured.name)
    boxes, boxes_sd = {own.name: own.boxes}, {own.name: own.boxes_sd}
    placement = Placement(boxes, boxes_sd, placed.marker_m, placed.marker_sd_m)
    seen = placement.seen(measured, trial.simulated)
    with np.errstate(invalid="ignore"):
        means = [
            MM * np.where(good, head.shape_m[frames], 0.0).sum(axis=0) / good.sum(axis=0)
            for head in (measured.head, trial.simulated, seen)
        ]
    order = np.argsort(means[1][:, 0])
    return means[0][order], means[1][order], means[2][order]
