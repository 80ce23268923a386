"""The figures of a free decay: its curves and the twin's, and its spectrum."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.free_decay import DecayFit, DecaySpectrum
from reports.colours import FAINT, INK, MUTED, TWIN
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, Margins, legend_above, panel, styled

_LABEL_GAP = 0.074  # least distance between two names, as a share of the height
_CLOSE = 0.24  # room for the names before time 0, as a share of the time shown
_STEP_S = 0.1  # the time axis ends at a multiple of this, so that similar decays get the same axis
_FADED = 0.02  # a swing below this share of the first one cannot be seen
_SHOWN = 2.6  # the spectrum is drawn up to this many times the frequency, rounded to a whole Hz


@styled
def decay_curve_figure(fit: DecayFit) -> Figure:
    """Draw the measured samples as dots and the twin as lines, about the straight tail."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    for k in range(len(fit.markers)):
        axes.plot(fit.time_s, fit.measured_m[:, k] * MM, ".", color=INK, markersize=2.2, label="measured", zorder=2.1)
        axes.plot(fit.time_s, fit.simulated_m[:, k] * MM, color=TWIN, linewidth=1.1, label="twin")
    end_s = _end_s(fit.time_s, np.abs(fit.simulated_m).max(axis=1))
    axes.set_xlim(-_CLOSE * end_s, end_s)
    axes.set_xticks([tick for tick in axes.get_xticks() if 0.0 <= tick <= end_s])
    _name_curves(axes, fit)
    axes.set(xlabel="time after the release (s)", ylabel="lateral position (mm)")
    legend_above(axes, 2)
    return figure


def _end_s(time_s: np.ndarray, swing: np.ndarray) -> float:
    """Find the end of the time axis: when the swing (n,) has faded, or the end of the decay."""
    swinging = np.flatnonzero(swing > _FADED * swing[0])
    faded_s = float(time_s[min(int(swinging[-1]) + 1, len(time_s) - 1)])
    return min(_STEP_S * float(np.ceil(faded_s / _STEP_S)), float(time_s[-1]))


def _name_curves(axes: Axes, fit: DecayFit) -> None:
    start = fit.simulated_m[0] * MM
    low, high = axes.get_ylim()
    order, place = np.argsort(start), start.copy()
    for before, k in pairwise(order):
        place[k] = max(place[k], place[before] + _LABEL_GAP * (high - low))
    place -= (place - start).mean()
    for name, at in zip(fit.markers, place, strict=True):
        text = shortened(name, 12)
        axes.annotate(text, (0.0, at), (-4, 0), textcoords="offset points", ha="right", va="center", fontsize=7.0)


@styled
def decay_spectrum_figure(spectrum: DecaySpectrum) -> Figure:
    """Draw amplitude over frequency for every tail marker, their rms, and its peak."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    end_hz = min(max(round(_SHOWN * (spectrum.peak_hz or 0.0)), 8), spectrum.bins_hz[-1])
    shown = spectrum.bins_hz <= end_hz
    bins_hz = spectrum.bins_hz[shown]
    axes.plot(bins_hz, spectrum.amplitude_m[shown] * MM, color=MUTED, linewidth=0.6, alpha=0.7, label="markers")
    axes.plot(bins_hz, spectrum.rms_m[shown] * MM, color=INK, linewidth=1.6, label="rms of markers")
    if spectrum.peak_hz is not None:
        height = float(np.interp(spectrum.peak_hz, spectrum.bins_hz, spectrum.rms_m)) * MM
        label = f"peak at {spectrum.peak_hz:.2f} Hz"
        axes.plot(spectrum.peak_hz, height, "o", color=INK, markerfacecolor=FAINT, markersize=5, label=label)
    axes.set_xlim(0.0, end_hz)
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel="frequency (Hz)", ylabel="lateral amplitude (mm)")
    legend_above(axes, 2)
    return figure
