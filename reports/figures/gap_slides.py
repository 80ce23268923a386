"""How fast markers slide along the fish, which nothing that swims does: what cameras, lenses and trackers do."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reports.diagnosed import Diagnosed
from reports.numbers import MM, in_words, shortened
from reports.style import FAINT, FULL_WIDTH_IN, INK, MUTED, SURFACE, TWIN, Margins, legend_on_top, panel, styled

_HEIGHT_IN, _MOST = 2.3, 6
_WORTH = 0.02  # of the gap
_MARKS = ("o", "s", "^", "D", "v", "P")


def slides(found: Diagnosed) -> bool:
    """Whether that is so much of the gap that it is worth a figure."""
    return found.shares("band").get("drift", 0.0) >= _WORTH


@styled
def gap_slides_figure(found: Diagnosed) -> Figure:
    """A place for each marker, a mark for each fitted trial; forward is up, in mm/s."""
    told = found.data.evidence.sliding
    trials, markers = told.trials[:_MOST], told.markers
    figure, axes = panel(FULL_WIDTH_IN, _HEIGHT_IN, Margins(left=0.62, right=0.15, top=0.38, bottom=0.46))
    axes.axhline(0.0, color=MUTED, linewidth=0.9)
    beside = np.linspace(-0.24, 0.24, len(trials)) if len(trials) > 1 else np.zeros(1)
    at = np.arange(len(markers))
    for number, (shift, plain) in enumerate(zip(beside, told.beside_plain, strict=False)):
        mark: dict[str, Any] = {"marker": _MARKS[number], "linestyle": "none", "markersize": 5}
        after = None if told.beside_effects is None else MM * told.beside_effects[number]
        if after is not None:
            axes.vlines(at + shift, MM * plain, after, color=FAINT, linewidth=1.6, zorder=1)
            axes.plot(at + shift, after, color=TWIN, **mark)
        axes.plot(at + shift, MM * plain, color=INK, markerfacecolor=SURFACE, **mark)
    axes.set(ylabel="slides forward (mm/s)", xlim=(-0.6, len(markers) - 0.4))
    axes.set_xticks(at, [in_words(name).replace(" ", "\n") for name in markers])
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    handles = [
        Line2D([], [], color=INK, markerfacecolor=SURFACE, marker=mark, linestyle="none", label=shortened(name, 14))
        for mark, name in zip(_MARKS, trials, strict=False)
    ]
    if told.beside_effects is not None:
        handles.append(Line2D([], [], color=TWIN, marker="o", linestyle="none", label="left with effects"))
    legend_on_top(figure, handles, len(handles))
    return figure
