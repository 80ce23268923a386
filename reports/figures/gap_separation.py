"""Which effects these swims can tell apart."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from reports.diagnosed import Diagnosed
from reports.numbers import in_words, shortened, shown
from reports.style import HALF_WIDTH_IN, INK, MUTED, SURFACE, TWIN, WARN, Margins, box, styled

APART = 3.3  # whitened distance from which one in twenty is taken for the other
MOST = 8
_LEFT_IN, _TOP_IN, _RIGHT_IN = 1.4, 1.4, 0.62


def told_apart(found: Diagnosed) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (e,) and distances (e, e) of at most eight effects that these data would have at all."""
    strong = [i for i in range(len(found.compared)) if np.nanmax(found.separation[i], initial=0.0) > 0][:MOST]
    return tuple(found.compared[i] for i in strong), found.separation[np.ix_(strong, strong)]


@styled
def gap_separation_figure(found: Diagnosed) -> Figure:
    """A row an effect as strong as these data would have it, a column each other that would stand in for it."""
    names, distance = told_apart(found)
    side = (HALF_WIDTH_IN - _LEFT_IN - _RIGHT_IN) / max(len(names), 1)
    height = side * len(names) + _TOP_IN + 0.08
    figure = Figure(figsize=(HALF_WIDTH_IN, height))
    axes = figure.add_axes(box(HALF_WIDTH_IN, height, Margins(_LEFT_IN, _RIGHT_IN, 0.08, _TOP_IN)))
    for i in range(len(names)):
        for j in range(len(names)):
            if i != j:
                _cell(axes, j, i, float(distance[i, j]))
    axes.set(xlim=(-0.5, len(names) - 0.5), ylim=(len(names) - 0.5, -0.5))
    labels = [shortened(in_words(name), 22) for name in names]
    axes.set_yticks(range(len(names)), labels)
    axes.set_xticks(range(len(names)), labels, rotation=60, ha="left", rotation_mode="anchor")
    axes.tick_params(length=0, labeltop=True, labelbottom=False, labelsize=7)
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    for label in [*axes.get_yticklabels(), *axes.get_xticklabels()]:
        label.set_fontweight("bold" if label.get_text() in map(in_words, found.data.effects) else "normal")
    handles = [
        Patch(facecolor=WARN, alpha=0.75, label=f"alike (below {APART})"),
        Patch(facecolor=TWIN, alpha=0.3, label="told apart"),
    ]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.01, 0.99), ncols=1)
    return figure


def _cell(axes: Axes, x: int, y: int, distance: float) -> None:
    if not np.isfinite(distance):
        axes.text(x, y, "–", ha="center", va="center", fontsize=7, color=MUTED)
        return
    face = (WARN, 0.75) if distance < APART else (TWIN, 0.12 + 0.3 * min(np.log10(distance / APART), 1.0))
    axes.add_patch(Rectangle((x - 0.47, y - 0.47), 0.94, 0.94, facecolor=face, edgecolor="none"))
    text = shown(distance, 0) if distance >= 10 else shown(distance, 1)
    axes.text(x, y, text, ha="center", va="center", fontsize=7, color=SURFACE if distance < APART else INK)
