"""The beat of the last marker as a loop: where it is, and how fast it goes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.signal import savgol_filter

from fitting import CalibratedTrial, tail_markers
from fitting.tail_tip import ORDER, WINDOW
from reports.figures.small_multiples import small_multiples
from reports.numbers import MM, shortened
from reports.style import INK, TWIN, Grid, Margins, legend_on_top, panels, styled
from swimmer import RobotSpec


@styled
def phase_portrait_figure(trials: Sequence[CalibratedTrial], robot: RobotSpec) -> Figure:
    """A panel for each trial, all to one scale: lateral place and speed of the last marker, scored window."""
    width, columns, _ = small_multiples(len(trials))
    figure, drawn = panels(len(trials), Grid(columns, None), width, Margins(left=0.62, top=0.5))
    loops = [beat_loops(trial, robot) for trial in trials]
    reach = 1.08 * max([float(np.nanmax(np.abs(loop), initial=0.0)) for pair in loops for loop in pair] + [0.005]) * MM
    for number, (axes, trial, pair) in enumerate(zip(drawn, trials, loops, strict=True)):
        for loop, colour, width in zip(pair, (INK, TWIN), (0.8, 1.1), strict=True):
            axes.plot(*(loop.T * MM), color=colour, linewidth=width)
        _dress(axes, reach)
        axes.set_title(shortened(trial.measured.name, 16), loc="left", fontweight="bold", pad=3)
        axes.tick_params(labelleft=number % columns == 0, labelbottom=number + columns >= len(trials))
    drawn[(len(drawn) - 1) // columns * columns].set_xlabel("lateral (mm)", loc="left")
    drawn[0].set_ylabel("lateral speed / ω (mm)")
    handles = [Line2D([], [], color=colour, label=name) for colour, name in ((INK, "measured"), (TWIN, "twin"))]
    legend_on_top(figure, handles, 2)
    return figure


def beat_loops(trial: CalibratedTrial, robot: RobotSpec) -> tuple[np.ndarray, np.ndarray]:
    """Lateral place, less its mean, and lateral speed over omega of the last marker, measured and simulated.

    Both speeds come from the same Savitzky-Golay filter. A pure sine gives a circle as wide as its amplitude.

    Returns:
        (k, 2) each, over the scored frames, m; nan where the measured sample is flagged and at the trial's ends.
    """
    measured = trial.measured
    tip = tail_markers(robot, measured.markers)[-1]
    good = (measured.weight[:, tip] > 0) & np.isfinite(measured.head.shape_m[:, tip, 1])
    omega, frame_s = 2 * np.pi * measured.frequency.hz, float(np.median(np.diff(measured.time_s)))
    loops = []
    for head, seen in ((measured.head, good), (trial.simulated, np.ones_like(good))):
        loops.append(_loop(head.shape_m[:, tip, 1], seen, frame_s, omega)[measured.scored])
    return loops[0], loops[1]


def _loop(lateral_m: np.ndarray, good: np.ndarray, frame_s: float, omega: float) -> np.ndarray:
    """(n, 2) of a whole trial; its ends, where half the filter hangs over, are nan."""
    if not good.any():
        return np.full((len(lateral_m), 2), np.nan)
    frames = np.arange(len(lateral_m))
    bridged = np.interp(frames, frames[good], lateral_m[good])
    window = min(WINDOW, len(bridged) - 1 + len(bridged) % 2)
    order = min(ORDER, window - 1)
    place = savgol_filter(bridged, window, order)
    speed = savgol_filter(bridged, window, order, deriv=1, delta=frame_s)
    loop = np.stack([place - place[good].mean(), speed / omega], axis=1)
    whole = (frames >= window // 2) & (frames < len(frames) - window // 2)
    return np.where((good & whole)[:, None], loop, np.nan)


def _dress(axes: Axes, reach: float) -> None:
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    step = next(size for size in (200, 100, 50, 20, 10, 5, 2, 1) if size < 0.9 * reach or size == 1)
    axes.set_xticks([-step, 0, step])
    axes.set_yticks([-step, 0, step])
