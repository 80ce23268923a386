"""The spectrum of a free decay, with its peak and the frequency the tail rings at."""

import numpy as np
from matplotlib.figure import Figure

from fitting.free_decay import DecaySpectrum
from reports.numbers import MM
from reports.style import FAINT, HALF_WIDTH_IN, INK, MUTED, TWIN, Margins, legend_above, panel, styled

SHOWN = 2.6  # times the frequency, up to where the spectrum is drawn, to a whole Hz


@styled
def decay_spectrum_figure(spectrum: DecaySpectrum) -> Figure:
    """Amplitude over frequency of every tail marker, their rms, and the two frequencies.

    The peak is what a Fourier transform reports; damping draws it away from the frequency of the zero crossings, whose
    95 % interval is shaded.
    """
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    rings_hz = spectrum.ring.frequency_hz
    end_hz = min(max(round(SHOWN * rings_hz), 8), spectrum.bins_hz[-1])
    shown = spectrum.bins_hz <= end_hz
    bins_hz = spectrum.bins_hz[shown]
    axes.plot(bins_hz, spectrum.amplitude_m[shown] * MM, color=MUTED, linewidth=0.6, alpha=0.7)
    axes.plot([], [], color=MUTED, linewidth=0.6, label="markers")
    axes.plot(bins_hz, spectrum.rms_m[shown] * MM, color=INK, linewidth=1.6, label="rms of markers")
    reach = 1.96 * spectrum.frequency_se_hz
    axes.axvspan(rings_hz - reach, rings_hz + reach, color=TWIN, alpha=0.25, linewidth=0)
    axes.axvline(rings_hz, color=TWIN, linewidth=1.1, label=f"rings at {rings_hz:.2f} Hz")
    if spectrum.peak_hz is not None:
        height = float(np.interp(spectrum.peak_hz, spectrum.bins_hz, spectrum.rms_m)) * MM
        label = f"peak at {spectrum.peak_hz:.2f} Hz"
        axes.plot(spectrum.peak_hz, height, "o", color=INK, markerfacecolor=FAINT, markersize=5, label=label)
    axes.set_xlim(0.0, end_hz)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("lateral amplitude (mm)")
    legend_above(axes, 2)
    return figure
