"""The figure of the forces that are missing on the head and in every hinge, over the beat."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.colours import EBT, EBT_LARGE, EBT_SMOOTHED, GAP, INKS, MUTED, TWIN, WARN
from reports.missing_forces import FORCES, HEAD, MissingForces, force_name
from reports.numbers import shortened
from reports.style import FULL_WIDTH_IN, Grid, Margins, legend_on_top, name_panels, panels, styled

COLOURS = (TWIN, EBT, EBT_SMOOTHED, EBT_LARGE, WARN, GAP, *(INKS[n].light for n in ("flag-merged", "flag-frozen")))
MILLI = 1000.0
_FINEST = 1.0  # every panel reaches at least this far, mN or mN m
_ANGLES = np.linspace(0.0, 2 * np.pi, 73)
_COLUMNS = 4


@styled
def gap_forces_figure(forces: MissingForces) -> Figure:
    """Draw a panel for each force or moment, a line for each swim with two standard deviations on either side."""
    mean, sd = forces.over(_ANGLES)
    grid = Grid(_COLUMNS, 1.1, (0.42, 0.42))
    figure, drawn = panels(len(forces.joints), grid, FULL_WIDTH_IN, Margins(left=0.55, top=0.52, bottom=0.42))
    for place, axes in enumerate(drawn):
        for trial, name in enumerate(forces.trials):
            _line(axes, mean[trial, place], sd[trial, place], COLOURS[trial % len(COLOURS)], shortened(name))
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        axes.set(xlim=(0, 360), xticks=[0, 90, 180, 270, 360])
        axes.locator_params(axis="y", nbins=5)
    names = [f"{force_name(joint)} ({'mN' if joint in FORCES else 'mN m'})" for joint in forces.joints]
    name_panels(drawn, names, _COLUMNS, "angle of the crank (°)")
    _level(drawn, forces.joints)
    legend_on_top(figure, min(len(forces.trials), 8))
    return figure


def _level(drawn: list[Axes], joints: tuple[str, ...]) -> None:
    """Give all hinges one scale, and no panel a scale so fine that nothing looks like something."""
    reach = {joint: max(map(abs, axes.get_ylim())) for axes, joint in zip(drawn, joints, strict=True)}
    hinges = max([reach[joint] for joint in joints if joint not in HEAD], default=0.0)
    for axes, joint in zip(drawn, joints, strict=True):
        end = max(reach[joint] if joint in HEAD else hinges, _FINEST)
        axes.set_ylim(-end, end)
        axes.tick_params(labelleft=True)


def _line(axes: Axes, mean: np.ndarray, sd: np.ndarray, colour: str, label: str) -> None:
    degrees = np.rad2deg(_ANGLES)
    axes.fill_between(degrees, MILLI * (mean - 2 * sd), MILLI * (mean + 2 * sd), color=colour, alpha=0.18, linewidth=0)
    axes.plot(degrees, MILLI * mean, color=colour, label=label)
