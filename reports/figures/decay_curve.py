"""A free decay beside the twin's: the lateral motion of every tail marker after the release."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.free_decay import DecayFit
from reports.numbers import MM, shortened
from reports.style import HALF_WIDTH_IN, INK, MUTED, TWIN, Margins, legend_above, panel, styled

LABEL_GAP = 0.074  # least distance between two names, of the height
CLOSE = 0.24  # of the time, before 0, that is left for the names
STEP_S = 0.1  # in which the end of the time axis is chosen, so that like decays are drawn alike
FADED = 0.02  # of the first swing, below which nothing is to be seen


@styled
def decay_curve_figure(fit: DecayFit) -> Figure:
    """Measured samples as dots, the twin as lines, about the straight tail; dotted, the widest swing's envelope."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    for k in range(len(fit.markers)):
        axes.plot(fit.time_s, fit.simulated_m[:, k] * MM, color=TWIN, linewidth=1.1)
        axes.plot(fit.time_s, fit.measured_m[:, k] * MM, ".", color=INK, markersize=2.2)
    envelope = fit.spectrum.ring.envelope_m
    widest = envelope[:, int(envelope[0].argmax())] * MM
    first = np.abs(fit.simulated_m).max() * MM
    near = widest <= 1.15 * first
    for sign in (-1.0, 1.0):
        axes.plot(fit.time_s[near], sign * widest[near], ":", color=MUTED, linewidth=0.9)
    end_s = _end_s(fit.time_s, widest)
    axes.set_xlim(-CLOSE * end_s, end_s)
    axes.set_xticks([tick for tick in axes.get_xticks() if 0.0 <= tick <= end_s])
    _name_curves(axes, fit)
    axes.plot([], [], ".", color=INK, label="measured")
    axes.plot([], [], color=TWIN, label="twin")
    axes.plot([], [], ":", color=MUTED, label="envelope")
    axes.set_xlabel("time after the release (s)")
    axes.set_ylabel("lateral position (mm)")
    legend_above(axes, 3)
    return figure


def _end_s(time_s: np.ndarray, envelope: np.ndarray) -> float:
    """Up to when the curves are worth a look: until the envelope (n,) has faded, or to the end."""
    swinging = np.flatnonzero(envelope > FADED * envelope[0])
    faded_s = float(time_s[min(int(swinging[-1]) + 1, len(time_s) - 1)])
    return min(STEP_S * float(np.ceil(faded_s / STEP_S)), float(time_s[-1]))


def _name_curves(axes: Axes, fit: DecayFit) -> None:
    """Names left of where the curves begin, apart from each other."""
    start = fit.simulated_m[0] * MM
    low, high = axes.get_ylim()
    order, place = np.argsort(start), start.copy()
    for before, k in pairwise(order):
        place[k] = max(place[k], place[before] + LABEL_GAP * (high - low))
    place -= (place - start).mean()
    for name, at in zip(fit.markers, place, strict=True):
        text = shortened(name, 12)
        axes.annotate(text, (0.0, at), (-4, 0), textcoords="offset points", ha="right", va="center", fontsize=7.0)
