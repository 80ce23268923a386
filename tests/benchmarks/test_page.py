"""The page of benchmarks has what the score files say, and these have what their records say."""

from pathlib import Path

import numpy as np

from benchmarks.cases import Run
from benchmarks.posterior.report import PosteriorOutcome, measure_posterior
from benchmarks.scores import DOCS, SCORES, Scores


def sessions() -> PosteriorOutcome:
    return measure_posterior(DOCS / "scores" / "posterior.jsonl", (), Run())


def test_the_page_has_every_score_that_has_a_requirement() -> None:
    lines = (DOCS / "benchmarks.md").read_text().splitlines()
    tables = [table for path in SCORES.glob("*.json") for table in Scores.read(path).tables]
    required = [row for table in tables if table.columns[1:2] == ("required",) for row in table.rows if row[1]]
    assert len(required) > 20
    for _, asked, *found in required:
        if len(found) == 1:
            assert any(f"| {asked} | {found[0]} |" in line for line in lines), found


def test_the_posteriors_tables_are_those_of_its_sessions() -> None:
    stands = Scores.read(SCORES / "posterior.json")
    assert stands == sessions().scores(stands.command)


def test_the_posterior_meets_what_is_asked() -> None:
    outcome = sessions()
    coverages = [outcome.warnings["covered"], *(found["covered"] for found in outcome.calibrations.values())]
    for low, high in (coverage.found.interval for coverage in coverages):
        assert low <= 0.94
        assert high >= 0.86
    assert np.max([score.r_hat for score in outcome.sessions]) <= 1.01


def test_every_score_file_says_on_what_it_was_measured() -> None:
    for path in Path(SCORES).glob("*.json"):
        assert Scores.read(path).data.startswith(("synthetic", "real"))
