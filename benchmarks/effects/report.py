"""Scores as a table for a terminal."""

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.effects.followed import FollowedScore
from benchmarks.effects.goals import CLEAR_ALONE, GOALS, GOALS_FOLLOWED, GOALS_WITHOUT, Goal
from benchmarks.effects.score import Score
from benchmarks.effects.scoring import Outcome
from benchmarks.effects.shares import Estimate, Share
from benchmarks.effects.together import TogetherScore
from benchmarks.effects.without import WithoutScore

_NOTES = """d: detectability; 95 % intervals, of shares by Wilson, of numbers by drawing sessions anew, of chance by
drawing what comes true; reachable: of all d, by a matched filter that knows what to look for and gives one false alarm
in a hundred"""
_LABEL, _ASKED, _CELL = 36, 12, 26  # characters
_PRESENT = {"null": "nothing there", "single": "one", "double": "two", "many": "many small", "outside": "outside"}


def outcome_text(outcome: Outcome) -> str:
    """All tables."""
    tables = [score_text(outcome.scores)]
    if outcome.without is not None:
        tables.append(without_text(outcome.without))
    if outcome.followed is not None:
        tables.append(followed_text(outcome.followed))
    if outcome.together is not None:
        tables.append(together_text(outcome.together))
    return "\n\n".join([*tables, _NOTES])


def score_text(scores: Mapping[str, Score]) -> str:
    """One column for each thing that was scored, beside what is asked."""
    shares = {name: score.headline for name, score in scores.items()}
    rows = [_row("", "asked", list(scores))]
    rows += [
        _row(goal.label, goal.asked, [share_text(each[what]) for each in shares.values()])
        for what, goal in GOALS.items()
    ]
    every = list(scores.values())
    rows += [
        _row("calibration error", "≤ 0.05", [estimate_text(score.calibration_error) for score in every]),
        _row(
            "the same, probabilities ≥ 10 %",
            "≤ 0.05",
            [estimate_text(score.calibration_error_of_suspects) for score in every],
        ),
        _row("  by chance, were they right", "", [estimate_text(score.calibration_error_by_chance) for score in every]),
        _row("shrinkage over the oracle's", "≥ 0.9", [estimate_text(score.shrinkage_of_oracle) for score in every]),
        _row("share of the gap on its stage", "", [estimate_text(score.share_on_stage) for score in every]),
        _row("seconds a session", "≤ 60", [estimate_text(score.seconds) for score in every]),
    ]
    said = [share_text(each.wrong_said) for each in scores.values()]
    rows.append(_row("only wrong names said, however sure", "", said))
    rows.append(_row("what is said holds what is there", "", [share_text(each.said_right) for each in scores.values()]))
    for what, label in CLEAR_ALONE.items():
        rows.append(_row(f"{label}, d ≥ 5", "", [share_text(score.clear_alone[what]) for score in scores.values()]))
    first = next(iter(scores.values()))
    for what, label in CLEAR_ALONE.items():
        rows.append(_row(f"{label}: reachable", "", [percent_text(first.reachable[what])]))
    for level in sorted({level for score in scores.values() for level in score.by_detectability}):
        cells = [share_text(score.by_detectability.get(level)) for score in scores.values()]
        rows.append(_row(f"right name first, d = {level:g}", "", cells))
    for level in sorted({level for score in scores.values() for level in score.in_three_by_detectability}):
        cells = [share_text(score.in_three_by_detectability.get(level)) for score in scores.values()]
        rows.append(_row(f"right name among three, d = {level:g}", "", cells))
    return "\n".join(rows)


def without_text(score: WithoutScore) -> str:
    """One column, beside what is asked."""
    rows = _asked_rows("without the effect that is there", score.headline, GOALS_WITHOUT)
    rows += [
        _row(f"unexplained, d = {level:g}", "", [share_text(share)]) for level, share in score.by_detectability.items()
    ]
    return "\n".join(rows)


def followed_text(score: FollowedScore) -> str:
    """One column, beside what is asked."""
    rows = _asked_rows("with the trial that was recommended", score.headline, GOALS_FOLLOWED)
    if score.missing:
        rows.append(_row("not followed", "", [str(score.missing)]))
    return "\n".join(rows)


def together_text(score: TogetherScore) -> str:
    """One column; speeds in mm/s."""
    rows = [_row("all effects at once", "", ["diagnosis"])]
    return "\n".join(rows + [_row(label, "", [cell]) for label, cell in together_rows(score)])


def together_rows(score: TogetherScore) -> list[tuple[str, str]]:
    """What is told of all effects at once, for a terminal and a page."""
    errors_mm_s = {what: error.times(1000.0) for what, error in score.speed_errors.items()}
    return [
        *((f"called for, {_PRESENT[kind]}", share_text(share)) for kind, share in score.called_for.items()),
        ("held-out speeds: better than plain", share_text(score.nearer["than_plain"])),
        ("better than with names alone", share_text(score.nearer["than_without"])),
        ("speed error, plain, mm/s", estimate_text(errors_mm_s["plain"])),
        ("with names alone", estimate_text(errors_mm_s["without"])),
        ("with all at once", estimate_text(errors_mm_s["together"])),
        ("shrinkage of the held-out gap", estimate_text(score.shrinkage)),
    ]


def share_text(share: Share | None, *, interval: bool = True) -> str:
    """A share and its interval, or the share alone."""
    if share is None or not share.of:
        return "none"
    low, high = share.interval
    text = f"{share.value:.0%} ({low:.0%} to {high:.0%})" if interval else f"{share.value:.0%}"
    return text.replace("%", " %")


def percent_text(value: float) -> str:
    """A share that was calculated, not counted."""
    return "none" if np.isnan(value) else f"{100 * value:.0f} %"


def estimate_text(estimate: Estimate, *, interval: bool = True) -> str:
    """A number and its interval, where there is one, or the number alone."""
    text = number_text(estimate.value)
    known = interval and not np.isnan(estimate.interval).any()
    return f"{text} ({estimate.interval[0]:.2g} to {estimate.interval[1]:.2g})" if known else text


def number_text(value: float) -> str:
    """A number to three digits."""
    return "none" if np.isnan(value) else f"{value:.3g}"


def _asked_rows(title: str, shares: Mapping[str, Share], goals: Mapping[str, Goal]) -> list[str]:
    rows = [_row(title, "asked", ["diagnosis"])]
    return rows + [_row(goal.label, goal.asked, [share_text(shares[what])]) for what, goal in goals.items()]


def _row(label: str, asked: str, cells: Sequence[str]) -> str:
    return f"{label:{_LABEL}}{asked:>{_ASKED}}" + "".join(f"{cell:>{_CELL}}" for cell in cells)
