"""The figure of the probability of each effect."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from diagnosis.result import DiagnosisResult
from reports.colours import FAINT, GAP, INK, MUTED, TWIN
from reports.numbers import in_words, shown
from reports.style import HALF_WIDTH_IN, Margins, panel, styled

HELD = 0.5  # the same as in `diagnosis.verdict`, which is not imported because it loads the twin
_MOST = 9  # largest number of effects that are shown
_LEAST = 0.005  # smallest probability that is shown of an effect that is not named
_OTHERS = {"none_of_these": "none of these", "nothing": "nothing at all"}


@styled
def gap_effects_figure(found: DiagnosisResult) -> Figure:
    """Draw a bar for each effect, the likeliest first; those that are named in colour."""
    chances = found.chances
    others = {"none_of_these": found.none_of_these, "nothing": found.no_gap_probability}
    likeliest = [name for name in chances if chances[name] >= _LEAST or name in found.effects][:_MOST]
    rows = [*((name, chances[name]) for name in likeliest), *others.items()]
    figure, axes = panel(HALF_WIDTH_IN, 0.62 + 0.21 * len(rows), Margins(left=1.55, right=0.42, bottom=0.36, top=0.16))
    axes.axvline(HELD, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0.5)
    axes.text(HELD, 0.75, "named from here", ha="center", va="bottom", fontsize=7, color=MUTED)
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
