"""Scores of finished clips stand for the next run, of the same clip and code only."""

from pathlib import Path

import pytest

from benchmarks import kept_scores
from benchmarks.kept_scores import kept
from benchmarks.tracking.accuracy import TrackingScore

SCORE = TrackingScore("slow", "ffv1", "hybrid", 0.01, 0.01, 0.0, 0.0, 0.0, 0, 0, 0.0, 0.0, 0.9, 1.5)


class Measured:
    """Counts how often it was asked to measure."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> TrackingScore:
        self.times += 1
        return SCORE


def test_a_finished_score_is_taken_up_and_measured_again_for_another_clip_or_other_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    truth, measure = tmp_path / "slow.truth.npz", Measured()
    truth.write_bytes(b"one")
    for _ in range(2):
        assert kept(tmp_path, "slow.score", truth, measure, TrackingScore) == SCORE
    assert measure.times == 1
    truth.write_bytes(b"another")
    kept(tmp_path, "slow.score", truth, measure, TrackingScore)
    assert measure.times == 2
    monkeypatch.setattr(kept_scores, "_code", lambda: {"tracker.py": "changed"})
    kept(tmp_path, "slow.score", truth, measure, TrackingScore)
    assert measure.times == 3


@pytest.mark.parametrize("content", ["", "[]", "{", '{"fingerprint": 1}'])
def test_a_broken_file_is_measured_again(tmp_path: Path, content: str) -> None:
    truth, measure = tmp_path / "slow.truth.npz", Measured()
    truth.write_bytes(b"one")
    (tmp_path / "slow.score.json").write_text(content)
    assert kept(tmp_path, "slow.score", truth, measure, TrackingScore) == SCORE
    assert measure.times == 1
