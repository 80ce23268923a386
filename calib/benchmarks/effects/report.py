"""Scores as a table for a terminal."""

from collections.abc import Mapping

import numpy as np

from calib.benchmarks.effects.score import Score, Share

ASKED = {
    "false_alarms": "<= 1 %",
    "right_first": ">= 85 %",
    "right_in_three": ">= 90 %",
    "confident_wrong": "<= 2 %",
    "unexplained_outside": ">= 80 %",
    "confident_outside": "<= 5 %",
    "doubles_in_groups": ">= 70 %",
    "stage_right": ">= 80 %",
    "interval_holds": "92 to 98 %",
}
"""What a diagnosis should reach."""


def score_text(scores: Mapping[str, Score]) -> str:
    """One column for each thing that was scored, beside what is asked."""
    head = f"{'':24}{'asked':>12}" + "".join(f"{name:>26}" for name in scores)
    shares = {name: score.headline for name, score in scores.items()}
    rows = [
        f"{what.replace('_', ' '):24}{asked:>12}" + "".join(f"{_cell(each[what]):>26}" for each in shares.values())
        for what, asked in ASKED.items()
    ]
    rows.append(_row("calibration error", "<= 0.05", [score.reliability.error for score in scores.values()]))
    rows.append(_row("shrinkage of oracle", ">= 0.9", [score.shrinkage_of_oracle for score in scores.values()]))
    rows.append(_row("seconds a session", "<= 60", [score.seconds for score in scores.values()]))
    levels = sorted({level for score in scores.values() for level in score.by_detectability})
    for level in levels:
        cells = [score.by_detectability.get(level) for score in scores.values()]
        rows.append(f"{f'right first, d = {level:g}':36}" + "".join(f"{_cell(cell):>26}" for cell in cells))
    return "\n".join([head, *rows, "shares with their 95 % interval (Wilson)"])


def _cell(share: Share | None) -> str:
    if share is None or not share.of:
        return "none"
    low, high = share.interval
    return f"{share.value:.0%} ({low:.0%} to {high:.0%})"


def _row(name: str, asked: str, values: list[float]) -> str:
    return f"{name:24}{asked:>12}" + "".join(f"{'none' if np.isnan(v) else format(v, '.3g'):>26}" for v in values)
