"""How likely each effect is, and which of them these swims can tell apart."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from diagnosis.result import DiagnosisResult
from reports.colours import FAINT, GAP, INK, MUTED, SURFACE, TWIN, WARN
from reports.numbers import in_words, shortened, shown
from reports.style import HALF_WIDTH_IN, Margins, panel, styled

HELD = 0.5  # as `diagnosis.verdict`, which is not imported, for it loads the twin
_MOST, _LEAST = 9, 0.005  # effects that are shown, and the probability of the last
_MOST_APART = 8
APART = 3.3  # whitened distance from which one in twenty is taken for the other
_MATRIX = Margins(left=1.4, right=0.62, bottom=0.08, top=1.4)
_OTHERS = {"none_of_these": "none of these", "nothing": "nothing at all"}


@styled
def gap_effects_figure(found: DiagnosisResult) -> Figure:
    """A bar an effect, the likeliest first; those that are named in colour."""
    chances = found.chances
    others = {"none_of_these": found.none_of_these, "nothing": found.no_gap_probability}
    told = [name for name in chances if chances[name] >= _LEAST or name in found.effects][:_MOST]
    rows = [*((name, chances[name]) for name in told), *others.items()]
    figure, axes = panel(HALF_WIDTH_IN, 0.62 + 0.21 * len(rows), Margins(left=1.55, right=0.42, bottom=0.36, top=0.16))
    axes.axvline(HELD, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0.5)
    axes.text(HELD, 0.75, "said from here", ha="center", va="bottom", fontsize=7, color=MUTED)
    for row, (name, chance) in enumerate(rows):
        _bar(axes, -row - 0.4 * (name in others), name, chance, found)
    ticks = [-row - 0.4 * (name in others) for row, (name, _) in enumerate(rows)]
    axes.set_yticks(ticks, [_OTHERS.get(name, in_words(name)) for name, _ in rows])
    for label, (name, _) in zip(axes.get_yticklabels(), rows, strict=True):
        label.set_fontweight("bold" if name in found.effects else "normal")
    axes.set(xlim=(0.0, 1.0), ylim=(ticks[-1] - 0.6, 0.7), xlabel="probability that it is present")
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    return figure


def _bar(axes: Axes, row: float, name: str, chance: float, found: DiagnosisResult) -> None:
    named = name in found.effects
    colour = TWIN if named else GAP if name == "none_of_these" else MUTED
    axes.barh(row, 1.0, height=0.66, color=FAINT, alpha=0.3)
    axes.barh(row, chance, height=0.66, color=colour, alpha=1.0 if chance >= HELD or not named else 0.7)
    axes.text(1.02, row, shown(chance, 2), va="center_baseline", fontsize=7.5, color=INK if named else MUTED)


def told_apart(found: DiagnosisResult) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (e,) and distances (e, e) of at most eight effects that these data would have at all."""
    names, distance = found.evidence.separation.compared, found.evidence.separation.distance
    strong = [i for i in range(len(names)) if np.nanmax(distance[i], initial=0.0) > 0][:_MOST_APART]
    return tuple(names[i] for i in strong), distance[np.ix_(strong, strong)]


@styled
def gap_separation_figure(found: DiagnosisResult) -> Figure:
    """A row an effect as strong as these data would have it, a column each other that would stand in for it."""
    names, distance = told_apart(found)
    side = HALF_WIDTH_IN - _MATRIX.left - _MATRIX.right
    figure, axes = panel(HALF_WIDTH_IN, side + _MATRIX.top + _MATRIX.bottom, _MATRIX)
    for i, j in np.argwhere(~np.eye(len(names), dtype=bool)):
        _cell(axes, j, i, float(distance[i, j]))
    axes.set(xlim=(-0.5, len(names) - 0.5), ylim=(len(names) - 0.5, -0.5))
    labels = [shortened(in_words(name), 22) for name in names]
    axes.set_yticks(range(len(names)), labels)
    axes.set_xticks(range(len(names)), labels, rotation=60, ha="left", rotation_mode="anchor")
    axes.tick_params(length=0, labeltop=True, labelbottom=False, labelsize=7)
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    for label in [*axes.get_yticklabels(), *axes.get_xticklabels()]:
        label.set_fontweight("bold" if label.get_text() in map(in_words, found.effects) else "normal")
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
