"""The figure of the shares of the gap by stage, trial, band and axis."""

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from diagnosis.result import DiagnosisResult
from reports.colours import FAINT, GAP, INK, MUTED, TWIN
from reports.numbers import in_words, shortened, whole_percent
from reports.style import FULL_WIDTH_IN, add_panel, legend_on_top, styled

_ROW_IN = 0.2
_LEFT_IN = 0.62
_TOP_IN = 0.52
_BOTTOM_IN = 0.34
_LABEL_IN = 0.82
_GAP_IN = 0.3
_NAMES = {"floor": "noise"}


@styled
def gap_shares_figure(found: DiagnosisResult) -> Figure:
    """Draw the shares in four panels, all from 0 to 100 %."""
    splits = {split: getattr(found.where, f"by_{split}") for split in ("stage", "trial", "band", "axis")}
    rows = max(len(shares) for shares in splits.values())
    height = _TOP_IN + rows * _ROW_IN + _BOTTOM_IN
    figure = Figure(figsize=(FULL_WIDTH_IN, height))
    width = (FULL_WIDTH_IN - _LEFT_IN - 3 * (_LABEL_IN + _GAP_IN) - 0.1) / 4.6
    left = _LEFT_IN
    for split, shares in splits.items():
        size = width * (1.6 if split == "stage" else 1.0), len(shares) * _ROW_IN
        axes = add_panel(figure, (left, height - _TOP_IN - size[1]), size)
        _bars(axes, shares, found.stage_alone if split == "stage" else {}, split)
        left += size[0] + _GAP_IN + _LABEL_IN
    handles = [
        Patch(facecolor=GAP, alpha=0.8, label="share, all stages together"),
        Line2D([], [], color=INK, linewidth=1.2, marker="|", markersize=7, label="if it were the only stage"),
        Patch(facecolor=MUTED, alpha=0.6, label="noise"),
    ]
    legend_on_top(figure, 3, handles)
    return figure


def _bars(axes: Axes, shares: Mapping[str, float], alone: Mapping[str, float], split: str) -> None:
    for row, (name, share) in enumerate(shares.items()):
        colour = MUTED if name == "floor" else GAP if split == "stage" else TWIN
        axes.barh(-row, 1.0, height=0.68, color=FAINT, alpha=0.35)
        axes.barh(-row, share, height=0.68, color=colour, alpha=0.6 if name == "floor" else 0.8)
        end = share
        if name in alone:
            end = max(share, alone[name])
            axes.plot([share, alone[name]], [-row, -row], color=INK, linewidth=1.2)
            axes.plot(alone[name], -row, "|", color=INK, markersize=7, markeredgewidth=1.3)
        text = whole_percent(share) if name not in alone else _range(share, alone[name])
        axes.text(max(end, 0.0) + 0.03, -row, text, va="center_baseline", fontsize=7, color=INK)
    axes.set(xlim=(min(0.0, *shares.values()), 1.32), ylim=(-len(shares) + 0.5, 0.5))
    axes.set_yticks(
        [-row for row in range(len(shares))],
        [shortened(name if split == "trial" else _NAMES.get(name, in_words(name)), 13) for name in shares],
    )
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100 %"])
    axes.set_title(f"by {split}", loc="left", pad=3, fontweight="bold")
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)


def _range(share: float, alone: float) -> str:
    """Format two shares as a range, `3 to 10 %`, or as one number where both are the same."""
    ends = [whole_percent(value) for value in sorted((share, alone))]
    return ends[0] if ends[0] == ends[1] else f"{ends[0][:-2]} to {ends[1]}"
