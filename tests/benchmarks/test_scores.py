"""Numbers stand with their intervals, in tables that a file, a terminal and a page share."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.scores import Estimate, Measure, Scores, Share, Table, median


def test_a_share_has_wilsons_interval() -> None:
    assert Share(0, 300).interval == pytest.approx((0.0, 0.01264), abs=1e-4)
    assert str(Share(3, 4)) == "3 of 4 (30 to 95 %)"
    assert np.isnan(Share(0, 0).value)
    assert str(Share(0, 0)) == "none"


@pytest.mark.long
def test_intervals_by_resampling_hold_the_truth_about_as_often_as_they_say() -> None:
    random = np.random.default_rng(2)
    found = [median(list(random.normal(0.8, 0.2, 30))).interval for _ in range(150)]
    assert 0.88 <= np.mean([low <= 0.8 <= high for low, high in found]) <= 1.0
    assert str(median([0.5])) == "0.5"  # too little for an interval
    assert str(median([])) == "none"
    assert str(Estimate(5.0, (2.5, 10.0))) == "5 (2.5 to 10)"


def test_scores_come_back_from_their_file_and_read_as_markdown(tmp_path: Path) -> None:
    row = Measure("right", Share(3, 4), "≥ 85 %")
    table = Table.of("Names", {"diagnosis": {"right": row}, "chance": {"right": Measure("right", Share(0, 4))}})
    scores = Scores("Effects", "synthetic", "python -m benchmarks effects F", (table,), ("Small.",))
    (tmp_path / "scores.json").write_text(scores.json())
    assert Scores.read(tmp_path / "scores.json") == scores
    lines = scores.text().splitlines()
    assert "| right | ≥ 85 % | 3 of 4 (30 to 95 %) | 0 of 4 (0 to 49 %) |" in lines
    assert lines[-1] == "- Small."
