"""The figures of the held-out swims before and after the effects were added."""

from math import isnan

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from diagnosis.result import DiagnosisResult, GapSize
from reports.colours import EBT_SMOOTHED, FAINT, GAP, INK, MUTED, SURFACE, TWIN, WARN
from reports.numbers import MM, in_words, of_its_size, shortened, shown, whole_percent
from reports.style import HALF_WIDTH_IN, Grid, Margins, legend_on_top, panel, panels, styled

_FLOOR = 1.0  # mean squared whitened residual of noise alone


@styled
def gap_waterfall_figure(found: DiagnosisResult) -> Figure:
    """Draw the mean squared whitened residual of the held-out swims; needs at least one, and an effect."""
    gap = found.gap
    before, after = gap.squares_before, gap.squares_after
    highest = max(before, after, _FLOOR)
    bottom = max(0.62, 0.32 + 0.125 * len(found.effect_parameters))  # a line an effect
    figure, axes = panel(HALF_WIDTH_IN, 1.98 + bottom, Margins(left=0.52, right=0.08, bottom=bottom, top=0.28))
    added = "with\n" + "\nand ".join(shortened(in_words(effect), 22) for effect in found.effect_parameters)
    names = {"plain twin": of_its_size(before), added: of_its_size(after - before, signed=True)}
    names |= {"remains": of_its_size(after), "noise": "1"}
    if not isnan(gap.shrinkage):
        share, above = f"{whole_percent(gap.shrinkage)} of the gap", max(before, after) + 0.15 * highest
        axes.text(1, above, share, ha="center", va="bottom", fontsize=7.5)
    ends = [(0.0, before), (before, after), (max(after, _FLOOR), _FLOOR), (_FLOOR, 0.0)]
    colours = [MUTED, EBT_SMOOTHED if after <= before else WARN, GAP, TWIN]
    for place, ((start, end), colour, value) in enumerate(zip(ends, colours, names.values(), strict=True)):
        height = max(abs(end - start), 0.004 * highest)
        axes.bar(place, height, bottom=min(start, end), width=0.72, color=colour, alpha=0.85)
        above = max(start, end) + 0.02 * highest
        axes.text(place, above, value, ha="center", va="bottom", fontsize=9, fontweight="bold")
        axes.plot([place + 0.36, place + 0.64], [end, end], color=MUTED, linewidth=0.8 if end else 0.0)
    axes.set_xticks(range(len(names)), list(names))
    axes.set(xlim=(-0.55, len(names) - 0.45), ylim=(0.0, 1.28 * highest), ylabel="mean squared residual")
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    return figure


@styled
def gap_held_out_figure(gap: GapSize, added: bool) -> Figure:
    """Draw a row for each held-out swim, of which there is at least one, and one for the mean.

    Left are marker distances in mm, right speed errors in mm/s.
    """
    trials = gap.trials or {}
    names, compared = [*trials, "mean"], list(trials.values())
    before_mm, after_mm = np.array([[trial.before_mm, trial.after_mm] for trial in compared]).T
    errors = MM * np.abs([[t.speed_before - t.speed_measured, t.speed_after - t.speed_measured] for t in compared]).T
    grid = Grid(2, 0.2 + 0.24 * len(names), (0.22, 0.0))
    figure, (left, right) = panels(2, grid, HALF_WIDTH_IN, Margins(left=0.85, right=0.2, top=0.5, bottom=0.42))
    _rows(left, _with_mean(before_mm), _with_mean(after_mm), added)
    _rows(right, _with_mean(errors[0]), _with_mean(errors[1]), added)
    left.axvline(gap.noise_floor_mm, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), label="noise")
    left.set(xlabel="marker distance (mm)")
    right.set(xlabel="speed error (mm/s)")
    left.set_yticks([-row for row in range(len(names))], [shortened(name, 12) for name in names])
    left.get_yticklabels()[-1].set_fontweight("bold")
    right.set_yticks([])
    legend_on_top(figure, 2)
    return figure


def _with_mean(values: np.ndarray) -> np.ndarray:
    return np.append(values, np.mean(values))


def _rows(axes: Axes, before: np.ndarray, after: np.ndarray, changed: bool) -> None:
    reach = (1.75 if changed else 1.25) * max(float(before.max()), float(after.max()), 1e-9)
    for row, (start, end) in enumerate(zip(before, after, strict=True)):
        last = row == len(before) - 1
        axes.plot([0, reach], [-row, -row], color=FAINT, linewidth=0.6, zorder=0.5)
        colour = EBT_SMOOTHED if end <= start else WARN
        size = 6 if last else 4.5
        axes.plot(
            start, -row, "o", color=MUTED, markerfacecolor=SURFACE, markersize=size, label="plain twin", zorder=2.1
        )
        if changed:
            label = "with effects" if end <= start else "worse with them"
            axes.plot([start, end], [-row, -row], color=colour, linewidth=2.4 if last else 1.6)
            axes.plot(end, -row, "o", color=colour, markersize=size, label=label)
        axes.text(
            max(start, end) + 0.05 * reach,
            -row,
            f"{shown(start, 1)} → {shown(end, 1)}" if changed else shown(start, 1),
            va="center_baseline",
            fontsize=7,
            color=INK,
            fontweight="bold" if last else "normal",
        )
    axes.set(xlim=(0.0, reach), ylim=(-len(before) + 0.4, 0.6))
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.locator_params(axis="x", nbins=4)
