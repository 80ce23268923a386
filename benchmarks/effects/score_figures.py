"""Figures of what came of a suite."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from benchmarks.effects.goals import Goal
from benchmarks.effects.score import OTHER, Score
from benchmarks.effects.shares import Share
from benchmarks.effects.suite import DETECTABILITIES
from reports.colours import EBT, EBT_LARGE, EBT_SMOOTHED, FAINT, INK, MUTED, SHADE, SURFACE, TWIN, WARN
from reports.style import FULL_WIDTH_IN, HALF_WIDTH_IN, Margins, legend_above, panel, styled

_RULES = ((EBT, "s"), (EBT_LARGE, "^"), (WARN, "D"), (MUTED, "v"), (EBT_SMOOTHED, "P"))  # colours and marks
_CELL_IN = 0.24  # of the confusion matrix, at most
_DARK = 0.5  # share from which a cell needs light text
_PERCENT = [f"{p} %" for p in (0, 25, 50, 75, 100)]
_AROUND_SHARES = Margins(left=0.72, right=0.2, top=0.5)  # of panels whose axes say 100 %


@styled
def goals_figure(shares: Mapping[str, Mapping[str, Share]], goals: Mapping[str, Goal]) -> Figure:
    """A row a goal: shaded what is asked, a mark with its 95 % interval for each program or rule that was scored.

    Args:
        shares: by program or rule, then by goal.
        goals: what is asked.
    """
    rows, height = list(goals), 0.34 if len(shares) > 1 else 0.26
    figure, axes = panel(FULL_WIDTH_IN, 0.95 + height * len(rows), Margins(left=2.35, right=0.85))
    shifts = np.linspace(-0.3, 0.3, len(shares)) if len(shares) > 1 else np.zeros(1)
    for row, what in enumerate(rows):
        goal = goals[what]
        axes.barh(row, goal.high - goal.low, left=goal.low, height=0.86, color=TWIN, alpha=0.16)
        axes.text(1.015, row, goal.asked, va="center", color=MUTED, transform=axes.get_yaxis_transform())
        for shift, (name, by_goal) in zip(shifts, shares.items(), strict=True):
            if by_goal[what].of:
                low, high = by_goal[what].interval
                look = looks(shares)[name]
                axes.plot([low, high], [row + shift] * 2, color=look["color"], linewidth=1.2)
                axes.plot(by_goal[what].value, row + shift, linestyle="none", **look)
    axes.set_yticks(range(len(rows)), [goals[what].label for what in rows])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(-0.01, 1.01)
    axes.set_xticks(np.linspace(0, 1, 5), _PERCENT)
    axes.set_xlabel("share of sessions, with 95 % interval; shaded: what is asked")
    _legend(axes, shares)
    return figure


@styled
def by_detectability_figure(shares: Mapping[str, Mapping[float, Share]], counted: str) -> Figure:
    """A line for each program or rule over the detectability.

    Args:
        shares: by program or rule, then by level.
        counted: what is right.
    """
    figure, axes = panel(HALF_WIDTH_IN, 2.9, _AROUND_SHARES)
    places = {0.0: 0, **{level: i + 1 for i, level in enumerate(DETECTABILITIES)}}
    shifts = np.linspace(-0.15, 0.15, len(shares)) if len(shares) > 1 else np.zeros(1)
    for shift, (name, by_level) in zip(shifts, shares.items(), strict=True):
        look = looks(shares)[name]
        x = [places[level] + shift for level in by_level]
        for at, share in zip(x, by_level.values(), strict=True):
            axes.plot([at, at], share.interval, color=look["color"], linewidth=1.0)
        axes.plot(x, [share.value for share in by_level.values()], **look)
    axes.set_xticks(list(places.values()), ["less", *(f"{level:g}" for level in DETECTABILITIES)])
    axes.set_xlim(-0.4, len(places) - 0.6)
    axes.set_ylim(-0.02, 1.02)
    axes.set_yticks(np.linspace(0, 1, 5), _PERCENT)
    axes.set_xlabel("detectability d of the effect (standard deviations)")
    axes.set_ylabel(counted)
    _legend(axes, shares, 2)
    return figure


@styled
def reliability_figure(score: Score) -> Figure:
    """How often what was told with a probability came true, with 95 % intervals."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, _AROUND_SHARES)
    axes.plot([0, 1], [0, 1], color=FAINT, linewidth=1.0)
    found = score.reliability
    most = max((true.of for true in found.true), default=1)
    for told, true in zip(found.told, found.true, strict=True):
        axes.plot([told, told], true.interval, color=TWIN, linewidth=1.0)
        axes.plot(told, true.value, "o", color=TWIN, markersize=3 + 6 * np.sqrt(true.of / most))
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xticks(np.linspace(0, 1, 5), _PERCENT)
    axes.set_yticks(np.linspace(0, 1, 5), _PERCENT)
    axes.set_xlabel("probability told that an effect is present")
    axes.set_ylabel("share that is")
    number = sum(true.of for true in found.true)
    axes.set_title(f"error {found.error:.3f}, {number} probabilities from 1 % on", loc="left", color=MUTED)
    return figure


@styled
def shrinkage_figure(score: Score) -> Figure:
    """Shrinkage that was told, with its 95 % interval, over what the true effects reach."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, _AROUND_SHARES)
    axes.plot([-1, 1], [-1, 1], color=FAINT, linewidth=1.0)
    for case in score.cases:
        reached, told = case.answer.oracle_shrinkage, case.told.shrinkage
        if reached is None or told is None:
            continue
        colour = TWIN if case.in_set else MUTED
        if case.told.interval is not None:
            axes.plot([reached] * 2, case.told.interval, color=colour, linewidth=0.6, alpha=0.35)
        axes.plot(reached, told, "o", color=colour, markersize=3, markerfacecolor=colour if case.in_set else SURFACE)
    axes.set_xlim(-0.05, 1.05)
    axes.set_ylim(-0.35, 1.05)
    axes.set_xticks(np.linspace(0, 1, 5), _PERCENT)
    axes.set_yticks(np.linspace(0, 1, 5), _PERCENT)
    axes.set_xlabel("shrinkage that the true effects reach, without noise")
    axes.set_ylabel("shrinkage told")
    marks = [
        Line2D(
            [], [], color=TWIN, marker="o", markersize=3, linestyle="none", label="all true effects among the names"
        ),
        Line2D([], [], color=MUTED, marker="o", markersize=3, linestyle="none", markerfacecolor=SURFACE, label="not"),
    ]
    legend_above(axes, 2, handles=marks)
    return figure


@styled
def confusion_figure(confusion: Mapping[str, Mapping[str, int]], order: Sequence[str]) -> Figure:
    """A row for each clear single effect that was present, a column for each that was named first.

    Args:
        confusion: counts.
        order: of the effects.
    """
    there = [name for name in order if name in confusion]
    named = {name for row in confusion.values() for name in row}
    columns = [name for name in order if name in named or name in confusion]
    columns += [name for name in sorted(named) if name not in columns and name != OTHER] + [OTHER]
    left, most, bottom, top = 1.75, FULL_WIDTH_IN - 1.75 - 0.1, 1.62, 0.1
    cell = min(most / len(columns), _CELL_IN)
    margins = Margins(left=left, right=FULL_WIDTH_IN - left - cell * len(columns), bottom=bottom, top=top)
    figure, axes = panel(FULL_WIDTH_IN, max(cell * len(there), _CELL_IN) + bottom + top, margins)
    for row, effect in enumerate(there):
        of = sum(confusion[effect].values())
        right = columns.index(effect)
        axes.barh(row, 1.0, left=right - 0.5, height=1.0, facecolor="none", edgecolor=FAINT, linewidth=0.6)
        for name, count in confusion[effect].items():
            column, share = columns.index(name), count / of
            ink = TWIN if name == effect else MUTED if name == OTHER else WARN
            axes.barh(row, 1.0, left=column - 0.5, height=1.0, color=ink, alpha=0.15 + 0.8 * share, linewidth=0)
            text = SURFACE if ink == TWIN and share > _DARK else INK
            axes.text(column, row, f"{count}", ha="center", va="center", fontsize=6.5, color=text)
    axes.set_yticks(range(len(there)), [name.replace("_", " ") for name in there], fontsize=7)
    axes.set_xticks(range(len(columns)), [name.replace("_", " ") for name in columns], rotation=90, fontsize=7)
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(there) - 0.5, -0.5)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_color(SHADE)
    axes.set_ylabel("present")
    axes.set_xlabel("named first")
    return figure


def looks(names: Mapping[str, object]) -> dict[str, dict[str, Any]]:
    """Colour and mark of each: the first is the program, the rest are rules."""
    first, *rules = names
    found: dict[str, dict[str, Any]] = {first: {"color": TWIN, "marker": "o", "markersize": 5}}
    for name, (colour, mark) in zip(rules, cycle(_RULES), strict=False):
        found[name] = {"color": colour, "marker": mark, "markersize": 3.2, "linewidth": 0.8}
    return found


def _legend(axes: Axes, names: Mapping[str, object], columns: int = 6) -> None:
    handles = [Line2D([], [], label=name, **look) for name, look in looks(names).items()]
    legend_above(axes, columns, handles=handles)
