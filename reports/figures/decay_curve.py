"""A free decay beside the twin's: the lateral motion of every tail marker after the release."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.free_decay import DecayFit
from reports.numbers import MM, shortened
from reports.style import FULL_WIDTH_IN, INK, MUTED, TWIN, legend_above, panel, styled

LABEL_GAP = 0.062  # least distance between two names, of the height
CLOSE = 0.16  # of the time, before 0, that is left for the names


@styled
def decay_curve_figure(fit: DecayFit) -> Figure:
    """Measured samples as dots, the twin as lines, about the straight tail; dotted, the widest swing's envelope."""
    figure, axes = panel(FULL_WIDTH_IN, 3.4)
    for k in range(len(fit.markers)):
        axes.plot(fit.time_s, fit.simulated_m[:, k] * MM, color=TWIN, linewidth=1.1)
        axes.plot(fit.time_s, fit.measured_m[:, k] * MM, ".", color=INK, markersize=2.6)
    envelope = fit.spectrum.ring.envelope_m
    widest = envelope[:, int(envelope[0].argmax())] * MM
    first = np.abs(fit.simulated_m).max() * MM
    near = widest <= 1.15 * first
    for sign in (-1.0, 1.0):
        axes.plot(fit.time_s[near], sign * widest[near], ":", color=MUTED, linewidth=0.9)
    axes.set_xlim(-CLOSE * float(fit.time_s[-1]), float(fit.time_s[-1]))
    axes.set_xticks([tick for tick in axes.get_xticks() if 0.0 <= tick <= fit.time_s[-1]])
    _name_curves(axes, fit)
    axes.plot([], [], ".", color=INK, label="measured")
    axes.plot([], [], color=TWIN, label="twin")
    axes.plot([], [], ":", color=MUTED, label="envelope")
    axes.set_xlabel("time after the release (s)")
    axes.set_ylabel("lateral position (mm)")
    legend_above(axes, 3)
    return figure


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
