"""How the neck sways over the frequency of the beat: a hull that rolls has a resonance, a rigid one has none."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.model.sway import Sway, Wave
from reports.colours import EBT, INK, TWIN
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, Grid, Margins, legend_above, panels, styled


@styled
def hull_roll_figure(sways: Mapping[str, Sway]) -> Figure:
    """Amplitude above, phase against the tail's end below; a trial each."""
    figure, (above, below) = panels(2, Grid(1, 1.45, (0.0, 0.12)), HALF_WIDTH_IN, Margins(top=0.52))
    ordered = sorted(sways.values(), key=lambda sway: sway.frequency_hz)
    for label, colour, mark, waves in (
        ("measured", INK, "o", [sway.measured for sway in ordered]),
        ("twin, rigid hull", EBT, ":", [sway.rigid for sway in ordered]),
        ("twin with the roll", TWIN, "-", [sway.rolling for sway in ordered]),
    ):
        hz = [sway.frequency_hz for sway in ordered]
        for axes, values in ((above, [wave.amplitude_m * MM for wave in waves]), (below, _phases(waves))):
            axes.plot(hz, values, mark, color=colour, markersize=5.5, linewidth=1.6, label=label)
    above.set_ylim(bottom=0.0)
    above.set_ylabel("amplitude (mm)")
    below.set_ylabel("ahead of tail (°)")
    below.set_xlabel("swim frequency (Hz)")
    _without_labels(above)
    legend_above(above, 2)
    return figure


def _phases(waves: list[Wave]) -> np.ndarray:
    return np.array([wave.phase_deg for wave in waves])


def _without_labels(axes: Axes) -> None:
    axes.set_xticklabels([])
