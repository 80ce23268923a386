"""The coefficients that other pairs of fit trials give."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from fitting import PairFit
from reports.figures.coefficient_scale import HIGH, LOW, NAMES, scale_by_root
from reports.style import HALF_WIDTH_IN, INK, MUTED, SHADE, TWIN, Margins, legend_above, panel, styled
from swimmer import FluidCoefficients


@styled
def pair_coefficients_figure(pairs: Sequence[PairFit], best: FluidCoefficients) -> Figure:
    """Dots are pairs, the diamond is the session's own fit; crosses swim backward from rest."""
    figure, axes = panel(HALF_WIDTH_IN, 2.76, Margins(left=1.0))
    rows = -np.arange(len(NAMES))
    axes.barh(rows, HIGH - LOW, left=LOW, height=0.6, color=SHADE)
    shift = np.linspace(-0.2, 0.2, len(pairs)) if len(pairs) > 1 else np.zeros(1)
    for pair, below in zip(pairs, shift, strict=True):
        mark = "o" if pair.swims_forward else "x"
        axes.plot(np.sqrt(pair.coefficients), rows + below, mark, color=MUTED, markersize=3.5)
    axes.plot(np.sqrt(best), rows, "D", color=TWIN, markersize=6)
    axes.plot([], [], "D", color=TWIN, markersize=6, label="this session’s fit")
    axes.plot([], [], "o", color=MUTED, markersize=3.5, label="a pair")
    if not all(pair.swims_forward for pair in pairs):
        axes.plot([], [], "x", color=INK, markersize=3.5, label="backward")
    axes.set_yticks(rows, NAMES)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("coefficient (no unit; square-root scale)")
    scale_by_root(axes)
    legend_above(axes, 3)
    return figure
