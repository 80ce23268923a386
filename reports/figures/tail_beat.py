"""The beat of the tail: the wave along it, and the loop of its last marker."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import savgol_filter

from fitting import CalibratedTrial
from fitting.body_wave import BodyWave
from fitting.ebt import ORDER, WINDOW
from fitting.in_pool import tail_markers
from reports.colours import INK, MUTED, TWIN
from reports.numbers import MM, shortened
from reports.style import Grid, Margins, legend_on_top, name_panels, panels, small_multiples, styled
from swimmer import RobotSpec

_STEPS = (200, 100, 50, 20, 10, 5, 2, 1)  # mm, of ticks


@styled
def body_wave_figure(names: Sequence[str], waves: Sequence[tuple[BodyWave, BodyWave]]) -> Figure:
    """A polar panel for each trial: angle is the lag behind the first tail marker, radius the amplitude.

    Markers whose amplitude is nan are left out.
    """
    width, columns = small_multiples(len(names))
    grid, margins = Grid(columns, None, gap_in=(0.34, 0.5)), Margins(left=0.12, right=0.3, bottom=0.12, top=0.7)
    figure, drawn = panels(len(names), grid, width, margins, projection="polar")
    reach = 1.1 * max([float(np.nanmax(wave.amplitude_m, initial=0.0)) for pair in waves for wave in pair] + [0.005])
    for axes, name, pair in zip(drawn, names, waves, strict=True):
        for wave, colour, face, name_of in zip(pair, (INK, TWIN), ("none", TWIN), ("measured", "twin"), strict=True):
            known = np.isfinite(wave.amplitude_m)
            lag, amplitude = wave.lag_rad[known], wave.amplitude_m[known] * MM
            axes.plot(lag, amplitude, "-o", color=colour, linewidth=1.1, markersize=2.4, label=name_of)
            if len(known) and known[-1]:
                axes.plot(lag[-1:], amplitude[-1:], "o", color=colour, markerfacecolor=face)
        _dress(axes, reach * MM)
        axes.set_title(shortened(name, 16), loc="left", fontweight="bold", pad=6, x=0.0)
    drawn[-1].plot([], [], "o", color=INK, markerfacecolor="none", label="last marker")
    legend_on_top(figure, 3)
    return figure


def _dress(axes: Axes, reach: float) -> None:
    step = next(size for size in _STEPS if size < 0.75 * reach or size == 1)
    axes.set_ylim(0.0, reach)
    rings = np.arange(step, reach, step)
    axes.set_yticks(rings, [*[""] * (len(rings) - 1), f"{rings[-1]:.0f} mm"], fontsize=6.5, color=MUTED)
    axes.set_rlabel_position(247)  # type: ignore[attr-defined]
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["0°", "90°", "", ""], fontsize=6.5)
    axes.tick_params(axis="x", pad=-3)
    axes.spines["polar"].set_visible(False)


@styled
def phase_portrait_figure(trials: Sequence[CalibratedTrial], robot: RobotSpec) -> Figure:
    """A panel for each trial, all to one scale: lateral place and speed of the last marker, scored window."""
    width, columns = small_multiples(len(trials))
    figure, drawn = panels(len(trials), Grid(columns, None), width, Margins(left=0.62, top=0.5))
    loops = [beat_loops(trial, robot) for trial in trials]
    reach = 1.08 * max([float(np.nanmax(np.abs(loop), initial=0.0)) for pair in loops for loop in pair] + [0.005]) * MM
    step = next(size for size in _STEPS if size < 0.9 * reach or size == 1)
    for axes, (measured, twin) in zip(drawn, loops, strict=True):
        axes.plot(*(measured.T * MM), color=INK, linewidth=0.8, label="measured")
        axes.plot(*(twin.T * MM), color=TWIN, linewidth=1.1, label="twin")
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
        axes.set(xticks=[-step, 0, step], yticks=[-step, 0, step])
    name_panels(drawn, [shortened(trial.measured.name, 16) for trial in trials], columns, "lateral (mm)")
    drawn[0].set_ylabel("lateral speed / ω (mm)")
    legend_on_top(figure, 2)
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
    seen = _loop(measured.head.shape_m[:, tip, 1], good, frame_s, omega)
    twin = _loop(trial.simulated.shape_m[:, tip, 1], np.ones_like(good), frame_s, omega)
    return seen[measured.scored], twin[measured.scored]


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
