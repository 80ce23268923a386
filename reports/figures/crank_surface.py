"""The error surface of the crank: the distance of the twin from each dry run, over arm, speed and phase."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from fitting.dry_run import CrankFit, CrankTrial
from reports.colours import EBT, INK, MUTED, TWIN
from reports.numbers import MM, shortened
from reports.style import FULL_WIDTH_IN, Grid, Look, Margins, legend_on_top, panels, styled

ABOVE_MM = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # heights of the contours above the lowest point
_SHADE = 0.11  # opacity of each level; levels overlap


@styled
def crank_surface_figure(fit: CrankFit) -> Figure:
    """Draw two panels a run: over arm and speed with the best phase, over arm and phase with the best speed."""
    grid = Grid(2, 1.9, gap_in=(0.7, 0.42))
    figure, drawn = panels(2 * len(fit.trials), grid, FULL_WIDTH_IN, Margins(left=0.66, top=0.56))
    for trial, left, right in zip(fit.trials, drawn[::2], drawn[1::2], strict=True):
        surface, best = trial.surface, trial.published
        _draw(left, surface.arm_m, surface.hz, surface.over_phase_m)
        _mark(left, fit, (best.arm_m, best.hz), trial.speed_hz)
        left.set_ylabel("speed (turns/s)")
        phase, over = _centre(trial)
        _draw(right, surface.arm_m, phase, over)
        _mark(
            right, fit, (best.arm_m, _shift_into_axis(best.phase_rad, phase)), _shift_into_axis(trial.phase_rad, phase)
        )
        right.set_ylabel("phase (°)")
        right.yaxis.set_major_locator(MultipleLocator(90.0))
        lowest = f"{MM * best.distance_m:.1f} mm at its lowest"
        left.set_title(f"{shortened(trial.name)}: {lowest}", loc="left", pad=3)
    for axes in drawn[-2:]:
        axes.set_xlabel("crank arm (mm)")
    legend_on_top(figure, 5)
    return figure


def _draw(axes: Axes, arm_m: np.ndarray, other: np.ndarray, distance_m: np.ndarray) -> None:
    """Draw contours of a distance (a, o), darker where it is lower."""
    distance = distance_m.T * MM
    lowest = float(distance.min())
    names = {lowest + above: f"+{above:g}" for above in ABOVE_MM if lowest + above < distance.max()}
    levels = list(names)
    for level in levels:
        axes.contourf(arm_m * MM, other, distance, [0.0, level], colors=[TWIN], alpha=_SHADE)
    lines = axes.contour(arm_m * MM, other, distance, levels, colors=[MUTED], linewidths=0.5)
    axes.clabel(lines, fmt=names, fontsize=6.0, colors=[INK])
    axes.set_xlim(arm_m[0] * MM, arm_m[-1] * MM)
    axes.grid(visible=False)


def _mark(axes: Axes, fit: CrankFit, published: tuple[float, float], joint: float) -> None:
    """Mark the run's own lowest point, the joint fit with its 95 % interval, and where the tail snaps."""
    ring: Look = {"color": EBT, "markersize": 5.0, "markerfacecolor": "none", "label": "lowest of this run (published)"}
    axes.plot(published[0] * MM, published[1], "D", **ring)
    axes.plot(fit.arm_m * MM, joint, "o", color=INK, markersize=4.0, label="joint fit, 95 %")
    axes.errorbar(fit.arm_m * MM, joint, xerr=1.96 * fit.arm_se_m * MM, fmt="none", ecolor=INK, elinewidth=1.2)
    for end in fit.smooth_m:
        if axes.get_xlim()[0] + 1e-6 < end * MM < axes.get_xlim()[1] - 1e-6:
            axes.axvline(end * MM, color=INK, linewidth=0.8, linestyle=(0, (1, 2)), label="the tail snaps over")


def _centre(trial: CrankTrial) -> tuple[np.ndarray, np.ndarray]:
    """Centre the phases on the fitted one.

    Returns:
        (p + 1,) phases in degrees, the fitted one in the middle, and (a, p + 1) the lowest distance over all speeds, m.
    """
    count = len(trial.surface.phase_rad)
    first = int(np.floor(trial.phase_rad / (2 * np.pi) * count)) - count // 2
    steps = first + np.arange(count + 1)
    return 360.0 * steps / count, trial.surface.over_speed_m[:, steps % count]


def _shift_into_axis(phase_rad: float, phase_deg: np.ndarray) -> float:
    """Shift a phase by whole turns into the range of the axis, in degrees."""
    return float((np.degrees(phase_rad) - phase_deg[0]) % 360.0 + phase_deg[0])
