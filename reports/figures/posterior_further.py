"""What one more swim would be worth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from reports.figures.coefficient_scale import NAMES
from reports.style import EBT, EBT_LARGE, HALF_WIDTH_IN, INK, MUTED, TWIN, WARN, Margins, legend_above, panel, styled

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings

_COLOURS = (TWIN, EBT, EBT_LARGE, INK, WARN)


@styled
def posterior_further_figure(found: Findings) -> Figure:
    """The standard deviation of each coefficient with one more swim over that without, by the swim's frequency."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    further = found.further
    order = np.argsort(further.frequency_hz)
    ratio = 100 * further.sd[order] / further.sd_now
    for i, name in enumerate(NAMES):
        wanted = bool(further.wanted[i])
        axes.plot(
            further.frequency_hz[order],
            ratio[:, i],
            color=_COLOURS[i],
            linewidth=1.6 if wanted else 0.8,
            linestyle="-" if wanted else (0, (2, 2)),
            marker="o",
            markersize=3 if wanted else 1.8,
            label=name,
        )
    axes.axvline(further.frequency_hz[0], color=MUTED, linewidth=0.7, linestyle=(0, (2, 2)))
    axes.set_ylim(0, 104)
    axes.set_xlabel("frequency of one more swim (Hz)")
    axes.set_ylabel("standard deviation left (%)")
    legend_above(axes, 3, columnspacing=1.0)
    return figure
