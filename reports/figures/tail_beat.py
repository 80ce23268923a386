"""The figure of the beat of the tail: the wave along it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.body_wave import BodyWave
from reports.colours import INK, MUTED, TWIN
from reports.numbers import MM, shortened
from reports.style import Grid, Margins, legend_on_top, panels, small_multiples, styled

_STEPS = (200, 100, 50, 20, 10, 5, 2, 1)  # mm, of ticks


@styled
def body_wave_figure(names: Sequence[str], waves: Sequence[tuple[BodyWave, BodyWave]]) -> Figure:
    """Draw a polar panel for each trial: angle is the lag behind the first tail marker, radius the amplitude.

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
