"""Shards fill a folder together; what is there stands, and what failed is tried again."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from distributed import LocalCluster

from benchmarks import spread
from benchmarks.posterior import run as posterior_run
from benchmarks.posterior import store as posterior_store
from benchmarks.posterior.effect_names import Effect
from benchmarks.posterior.report import Asked, measure_posterior
from benchmarks.posterior.run import run_sessions
from benchmarks.posterior.score import PosteriorScore
from benchmarks.posterior.store import ScoreStore
from session import InputError, NotEnoughData
from tests.benchmarks.posterior.scores import score


@pytest.fixture
def scored(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Seeds that were scored, without a simulation; session 13 fails."""
    seeds: list[int] = []

    def measure(seed: int, _effect: Effect, _strength: float, workers: int) -> PosteriorScore:
        assert workers == 1
        seeds.append(seed)
        if seed == 13:
            raise NotEnoughData("too short")
        return score(seed)

    monkeypatch.setattr(posterior_run, "score_session", measure)
    return seeds


def test_what_is_there_is_not_scored_again_and_shards_add_up(tmp_path: Path, scored: list[int]) -> None:
    measure_posterior(tmp_path, Asked(first=0, count=3, workers=1))
    outcome = measure_posterior(tmp_path, Asked(first=2, count=10, workers=1))
    assert scored == list(range(12))
    assert [each.seed for each in outcome.scores] == list(range(12))
    np.testing.assert_equal(vars(outcome.scores[1]), vars(score(1)))


@pytest.mark.usefixtures("scored")
def test_a_file_is_one_line_of_json(tmp_path: Path) -> None:
    measure_posterior(tmp_path, Asked(count=1, workers=1))
    text = (tmp_path / "sessions" / "0.json").read_text()
    assert text.count("\n") == 1
    assert json.loads(text)["exact_width"][4] is None


def test_scores_of_other_code_are_left_out_and_made_anew(
    tmp_path: Path, scored: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    measure_posterior(tmp_path, Asked(count=2, workers=1))
    (tmp_path / "sessions" / "1.json").write_text("{")
    monkeypatch.setattr(posterior_store, "_code", lambda: {"gait.py": "changed"})
    outcome = measure_posterior(tmp_path, Asked(count=0, workers=1))
    assert (outcome.scores, outcome.others) == ((), 2)
    measure_posterior(tmp_path, Asked(count=2, workers=1))
    assert scored == [0, 1, 0, 1]


@pytest.mark.usefixtures("scored")
def test_an_unmodelled_effect_has_a_folder_of_its_own(tmp_path: Path) -> None:
    measure_posterior(tmp_path, Asked(count=1, workers=1))
    measure_posterior(tmp_path, Asked(count=1, effect="current", workers=1))
    measure_posterior(tmp_path, Asked(count=1, effect="current", strength=0.25, workers=1))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sessions", "sessions-current", "sessions-current-0.25"]


def test_a_session_that_fails_is_told_and_tried_again(tmp_path: Path, scored: list[int]) -> None:
    for _ in range(2):
        outcome = measure_posterior(tmp_path, Asked(first=12, count=3, workers=1))
        assert [each.seed for each in outcome.scores] == [12, 14]
        assert outcome.failures == ((13, "NotEnoughData: too short"),)
    assert scored == [12, 13, 14, 13]
    assert measure_posterior(tmp_path, Asked(count=0)).failures == ((13, "NotEnoughData: too short"),)


@pytest.mark.usefixtures("scored")
def test_a_session_that_failed_once_and_then_did_not_is_no_failure(tmp_path: Path) -> None:
    measure_posterior(tmp_path, Asked(first=12, count=3, workers=1))
    store = ScoreStore(tmp_path, "none")
    store.keep(score(13))
    assert measure_posterior(tmp_path, Asked(count=0)).failures == ()
    assert not list(store.sessions.glob("*.failed"))


def test_scores_in_one_file_are_judged_whichever_code_made_them(tmp_path: Path, scored: list[int]) -> None:
    folder, file = tmp_path / "scores", tmp_path / "scores.jsonl"
    before = measure_posterior(folder, Asked(count=3, workers=1))
    lines = [path.read_text().replace('"fingerprint": "', '"fingerprint": "0') for path in folder.rglob("*.json")]
    file.write_text("".join(lines))
    assert list(map(repr, measure_posterior(file, Asked()).scores)) == list(map(repr, before.scores))
    assert scored == [0, 1, 2]
    file.write_text(lines[0] + lines[1].replace('"none"', '"current"'))
    assert [measure_posterior(file, Asked()).effect, before.effect] == ["any", "none"]


def test_all_lines_that_are_no_scores_are_told(tmp_path: Path) -> None:
    file = tmp_path / "scores.jsonl"
    file.write_text('{"seed": 1}\nnonsense\n[]\n')
    with pytest.raises(InputError, match=r"(?s)scores.jsonl.*line 1.*line 2.*line 3"):
        measure_posterior(file, Asked())
    with pytest.raises(InputError, match="cannot be read"):
        measure_posterior(tmp_path / "none.jsonl", Asked())


def test_the_workers_of_a_scheduler_score_as_well(tmp_path: Path, scored: list[int]) -> None:
    store = ScoreStore(tmp_path, "none")
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster:
        run_sessions(store, range(4), scheduler=cluster.scheduler_address)
    assert sorted(scored) == [0, 1, 2, 3]
    assert [each.seed for each in store.scores()] == [0, 1, 2, 3]


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread, "_PATIENCE_S", 0.2)
    with pytest.raises(InputError, match=r"--scheduler: no scheduler answers there.*tcp://127\.0\.0\.1:1.*dask worker"):
        run_sessions(ScoreStore(tmp_path, "none"), range(2), scheduler="tcp://127.0.0.1:1")
