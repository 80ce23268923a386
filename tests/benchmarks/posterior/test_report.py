"""The tables of the posterior's benchmark tell a posterior that is right from one that is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.cases import Failure, Run
from benchmarks.posterior import report
from benchmarks.posterior.report import PosteriorOutcome, holm, measure_posterior, uniform_p
from benchmarks.posterior.score import PosteriorScore
from swimcal.errors import NotEnoughData
from tests.cases import later

ALONE = Run(workers=1)


def score(seed: int, narrow: float = 1.0, shift: float = 0.0, warns: bool = False) -> PosteriorScore:
    """A truth drawn from a unit normal that the posterior believes to be so wide, after a shift."""
    random = np.random.default_rng(seed)
    truth = random.standard_normal(5)
    draws = shift + narrow * random.standard_normal((4000, 5))
    q05, q95 = np.quantile(draws, [0.05, 0.95], axis=0)
    return PosteriorScore(
        seed=seed,
        varied=seed % 2 == 1,
        truth=tuple(truth),
        below=tuple(map(float, (draws < truth).mean(axis=0))),
        q05=tuple(q05),
        q95=tuple(q95),
        mean=tuple(draws.mean(axis=0)),
        sd=tuple(draws.std(axis=0)),
        r_hat=(1.0,) * 5,
        misfit_p=0.001 if warns else 0.5,
        flags=(),
        seconds=20.0,
    )


@pytest.fixture
def scored(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Seeds that were scored, without a simulation; session 13 fails."""
    seeds: list[int] = []

    def measure(seed: int) -> PosteriorScore:
        seeds.append(seed)
        if seed == 13:
            raise NotEnoughData("too short")
        return score(seed)

    monkeypatch.setattr(report, "score_session", measure)
    return seeds


def test_shards_add_up_and_what_failed_is_tried_again(tmp_path: Path, scored: list[int]) -> None:
    measure_posterior(tmp_path, range(3), ALONE)
    for _ in range(2):
        outcome = measure_posterior(tmp_path, range(2, 15), ALONE)
        assert outcome.failures == (("13", "NotEnoughData: too short"),)
    assert scored == [*range(15), 13]
    assert [each.seed for each in outcome.sessions] == [*range(13), 14]
    assert outcome.gaps == [13]
    np.testing.assert_equal(vars(outcome.sessions[1]), vars(score(1)))


def test_a_file_of_scores_is_judged_and_nothing_is_run(tmp_path: Path, scored: list[int]) -> None:
    before = measure_posterior(tmp_path, range(2), ALONE)
    assert repr(measure_posterior(tmp_path / "sessions.jsonl", range(9), ALONE)) == repr(before)
    assert scored == [0, 1]


@pytest.mark.long
def test_a_posterior_that_is_right_passes() -> None:
    for found in PosteriorOutcome(tuple(map(score, range(400)))).calibrations.values():
        low, high = found["covered"].found.interval
        assert low < 0.9 < high
        assert found["ks_p"].found.value > 0.05
        assert found["spread"].found.value == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
@pytest.mark.parametrize(("narrow", "shift"), [(0.6, 0.0), *later((1.0, 0.7))])
def test_one_that_is_too_narrow_or_shifted_does_not(narrow: float, shift: float) -> None:
    for found in PosteriorOutcome(tuple(score(seed, narrow, shift) for seed in range(400))).calibrations.values():
        assert found["covered"].found.interval[1] < 0.9
        assert found["ks_p"].found.value < 0.01


def test_sessions_whose_trials_vary_are_told_apart() -> None:
    scores = [score(seed, 0.2 if seed % 2 else 1.0) for seed in range(100)]
    found = next(iter(PosteriorOutcome(tuple(scores)).calibrations.values()))
    assert found["varied"].found.value < 0.5 < 0.8 < found["alike"].found.value
    assert found["covered"].found.of == found["varied"].found.of + found["alike"].found.of


def test_a_miss_with_a_warning_is_not_silent() -> None:
    silent, warned = (
        PosteriorOutcome(tuple(score(seed, 0.05, warns=warns) for seed in range(20))).warnings
        for warns in (False, True)
    )
    assert silent["far_silent"].found.value > 0.9
    assert [warned[name].found.value for name in ("silent", "far_silent", "warned")] == [0.0, 0.0, 1.0]
    assert warned["model_discrepancy"].found == (20, 20)


def test_few_sessions_are_not_tested_for_uniformity() -> None:
    assert np.isnan(uniform_p(np.linspace(0, 1, 20)))


def test_p_values_are_corrected_for_their_number() -> None:
    assert holm(np.array([[0.01, 0.04], [0.03, 0.005]])) == pytest.approx(np.array([[0.03, 0.06], [0.06, 0.02]]))


def test_failures_and_seeds_without_a_score_are_told() -> None:
    text = PosteriorOutcome((score(0), score(2)), (Failure("7", "NotEnoughData: too short"),)).scores("").text()
    assert "Session 7 failed: NotEnoughData: too short" in text
    assert "No score of seeds 1." in text
