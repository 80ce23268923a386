"""The page of scores is what the score files say, and these are what their records say."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.cases import Run
from benchmarks.page import DOCS, SCORES, page
from benchmarks.posterior.report import Asked, PosteriorOutcome, measure_posterior
from benchmarks.scores import Scores

POSTERIORS = ("posterior", "posterior_unmodelled")


def sessions(name: str) -> PosteriorOutcome:
    return measure_posterior(DOCS / "scores" / f"{name}.jsonl", Asked(), Run())


def test_the_page_is_up_to_date() -> None:
    assert (DOCS / "benchmarks.md").read_text() == page(), "make it again: python -m benchmarks.page"


@pytest.mark.parametrize("name", POSTERIORS)
def test_the_posteriors_tables_are_those_of_its_sessions(name: str) -> None:
    stands = Scores.read(SCORES / f"{name}.json")
    assert stands == sessions(name).scores(stands.command)


def test_the_posterior_meets_what_is_asked() -> None:
    outcome = sessions("posterior")
    assert [score.seed for score in outcome.sessions] == list(range(300))
    for found in outcome.calibrations.values():
        assert 0.86 <= found["covered"].found.value <= 0.94
        assert min(found[p].found.value for p in ("chi2_p", "ks_p")) >= 0.05
        assert found["width"].found.value <= 1.3
    assert np.max([score.r_hat for score in outcome.sessions]) <= 1.01


def test_with_an_effect_no_interval_is_wrong_in_silence() -> None:
    with_effect = [score for score in sessions("posterior_unmodelled").sessions if score.effect != "none"]
    assert len(with_effect) == 52
    assert max(score.farthest for score in with_effect if not score.warned) < 3


def test_every_score_file_says_on_what_it_was_measured() -> None:
    for path in Path(SCORES).glob("*.json"):
        assert Scores.read(path).data.startswith(("synthetic", "real"))
