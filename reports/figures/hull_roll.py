"""The figure of the neck's sway over the frequency of the beat: a hull that rolls has a resonance, a rigid one none."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from fitting.body_wave import Sway
from reports.colours import EBT, INK, TWIN
from reports.numbers import MM
from reports.style import HALF_WIDTH_IN, Grid, Look, Margins, legend_above, panels, styled


@styled
def hull_roll_figure(sways: Mapping[str, Sway]) -> Figure:
    """Draw the amplitude above and the phase against the tail's end below; each trial is a point."""
    figure, (above, below) = panels(2, Grid(1, 1.45, (0.0, 0.12)), HALF_WIDTH_IN, Margins(top=0.52))
    ordered = sorted(sways.values(), key=lambda sway: sway.frequency_hz)
    for label, colour, mark, waves in (
        ("measured", INK, "o", [sway.measured for sway in ordered]),
        ("twin, rigid hull", EBT, ":", [sway.rigid for sway in ordered]),
        ("twin with the roll", TWIN, "-", [sway.rolling for sway in ordered]),
    ):
        hz = [sway.frequency_hz for sway in ordered]
        look: Look = {"color": colour, "markersize": 5.5, "linewidth": 1.6, "label": label}
        above.plot(hz, [wave.amplitude_m * MM for wave in waves], mark, **look)
        below.plot(hz, [wave.phase_deg for wave in waves], mark, **look)
    above.set_ylim(bottom=0.0)
    above.set_ylabel("amplitude (mm)")
    below.set(ylabel="ahead of tail (°)", xlabel="swim frequency (Hz)")
    above.set_xticklabels([])
    legend_above(above, 2)
    return figure
