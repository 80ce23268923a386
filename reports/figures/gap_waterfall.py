"""How far the held-out gap shrinks: from the plain twin over what the effects take to what is noise."""

from __future__ import annotations

from math import isnan
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.diagnosed import Diagnosed
from reports.numbers import in_words, of_its_size, shortened, whole_percent
from reports.style import EBT_SMOOTHED, GAP, HALF_WIDTH_IN, INK, MUTED, TWIN, WARN, Margins, panel, styled

_FLOOR = 1.0  # mean squared whitened residual of noise alone


class _Step(NamedTuple):
    """One bar: from, to, colour, what stands under it, over it and smaller above that."""

    start: float
    end: float
    colour: str
    name: str
    value: str
    detail: str = ""


@styled
def gap_waterfall_figure(found: Diagnosed) -> Figure:
    """Mean squared whitened residual of the held-out swims; needs at least one."""
    gap = found.data.gap
    before, after = gap.squares_before, gap.squares_after
    steps = [_Step(0.0, before, MUTED, "plain twin", of_its_size(before))]
    if found.refitted:
        better = after <= before
        change = of_its_size(after - before, signed=True)
        share = "" if isnan(gap.shrinkage) else f"{whole_percent(gap.shrinkage)} of the gap"
        name = "with\n" + "\nand ".join(shortened(in_words(effect), 22) for effect in found.refitted)
        steps.append(_Step(before, after, EBT_SMOOTHED if better else WARN, name, change, share))
    steps.append(_Step(_FLOOR, max(after, _FLOOR), GAP, "left", of_its_size(after)))
    steps.append(_Step(0.0, _FLOOR, TWIN, "noise", "1"))
    figure, axes = panel(HALF_WIDTH_IN, 2.6, Margins(left=0.52, right=0.08, bottom=0.62, top=0.28))
    highest = max(before, after, _FLOOR)
    for place, step in enumerate(steps):
        _draw(axes, place, step, highest)
        if place + 1 < len(steps):
            level = after if step.name != "plain twin" or not found.refitted else before
            level = _FLOOR if step.name == "left" else level
            axes.plot([place + 0.36, place + 0.64], [level, level], color=MUTED, linewidth=0.8)
    axes.set_xticks(range(len(steps)), [step.name for step in steps])
    axes.set(xlim=(-0.55, len(steps) - 0.45), ylim=(0.0, 1.22 * highest), ylabel="mean squared residual")
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    return figure


def _draw(axes: Axes, place: int, step: _Step, highest: float) -> None:
    low, high = sorted((step.start, step.end))
    axes.bar(place, max(high - low, 0.004 * highest), bottom=low, width=0.72, color=step.colour, alpha=0.85)
    above = high + 0.02 * highest
    axes.text(place, above, step.value, ha="center", va="bottom", fontsize=9, fontweight="bold", color=INK)
    axes.text(place, above + 0.085 * highest, step.detail, ha="center", va="bottom", fontsize=7.5, color=INK)
