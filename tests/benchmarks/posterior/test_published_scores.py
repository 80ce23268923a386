"""What the documentation says of the posterior's calibration is what the scores beside it say."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.posterior.report import Calibration, PosteriorOutcome
from benchmarks.posterior.score import PosteriorScore
from benchmarks.posterior.store import read_scores

Sets = dict[tuple[str, float], list[PosteriorScore]]
DOCS = Path(__file__).parents[3] / "docs"
ROWS: dict[str, Callable[[Calibration], str]] = {
    "truths within their 90 % interval": lambda c: f"{100 * c.covered:.1f} %",
    "95 % interval of that share": lambda c: f"{100 * c.covered_low:.0f} to {100 * c.covered_high:.0f} %",
    "rms of truth less mean, in sd": lambda c: f"{c.spread:.2f}",
    "uniform ranks (Kolmogorov and Smirnov, Holm-corrected for ten)": lambda c: f"{c.ks_p:.2f}",
    "uniform ranks (chi-squared over ten bins, likewise)": lambda c: f"{c.chi2_p:.2f}",
    "width over the exact likelihood's: median, 95th percentile": lambda c: f"{c.width:.2f}, {c.width_95:.2f}",
    "sessions wider than 1.3 times": lambda c: f"{100 * c.wide:.0f} %",
}


@pytest.fixture(scope="module")
def outcome() -> PosteriorOutcome:
    return PosteriorOutcome("none", read_scores(DOCS / "posterior_scores.jsonl"))


def test_every_number_of_the_table_is_theirs(outcome: PosteriorOutcome) -> None:
    text = (DOCS / "posterior.md").read_text()
    for title, written in ROWS.items():
        line = next(line for line in text.splitlines() if line.startswith(f"| {title} |"))
        assert re.split(r"\s*\|\s*", line)[2:-1] == [written(each) for each in outcome.calibrations], title


def test_they_are_as_many_as_they_should_be_and_meet_what_is_asked(outcome: PosteriorOutcome) -> None:
    assert [score.seed for score in outcome.scores] == list(range(300))
    assert {score.effect for score in outcome.scores} == {"none"}
    assert set(outcome.misses.values()) == {()}
    assert np.max([score.r_hat for score in outcome.scores]) <= 1.01
    assert np.min([score.ess_bulk for score in outcome.scores]) >= 100


@pytest.fixture(scope="module")
def unmodelled() -> Sets:
    found: Sets = {}
    for score in read_scores(DOCS / "posterior_unmodelled.jsonl"):
        found.setdefault((score.effect, score.strength), []).append(score)
    return found


def farthest(scores: list[PosteriorScore]) -> str:
    return f"{max(np.abs(score.off_sd).max() for score in scores):.1f}" if scores else "–"


def told(scores: list[PosteriorScore]) -> list[str]:
    warned = [score for score in scores if score.warned]
    others = [score for score in warned if score.warnings != {"effect_left_out"}]
    silent = [score for score in scores if not score.warned]
    return [*map(str, (len(scores), len(warned), len(others))), farthest(warned), farthest(silent)]


def test_every_number_of_the_unmodelled_sets_is_theirs(unmodelled: Sets) -> None:
    text = (DOCS / "posterior.md").read_text()
    for (effect, strength), scores in unmodelled.items():
        name = effect.replace("_", " ")
        start = "| nothing |" if effect == "none" else f"| {name} | {strength:g} |"
        line = next(line for line in text.splitlines() if line.startswith(start))
        assert re.split(r"\s*\|\s*", line)[3:-1] == told(scores), start


def test_with_an_effect_no_interval_is_wrong_in_silence(unmodelled: Sets) -> None:
    with_effect = [score for (effect, _), scores in unmodelled.items() if effect != "none" for score in scores]
    assert len(with_effect) == 52
    silent = [score for score in with_effect if not score.warned]
    assert max(np.abs(score.off_sd).max() for score in silent) < 3
