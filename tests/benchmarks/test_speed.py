"""`python -m benchmarks speed`: rates of one run, and what the step costs."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import speed
from benchmarks.scores import Scores
from tests.calib.door import Front


@pytest.mark.long
def test_the_step_costs_next_to_nothing_in_accuracy() -> None:
    mean_mm, rms_mm, largest_mm, speed_error, _ = speed.measure_step_error(speed.FITTED)

    assert mean_mm <= 0.2
    assert mean_mm <= rms_mm <= largest_mm
    assert speed_error <= 0.02


@pytest.mark.long
def test_the_benchmark_reports_rates_and_errors_of_one_run(
    benchmarks: Front, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(speed, "_REPEATS", 1)
    monkeypatch.setattr(speed, "FREQUENCIES_HZ", np.array([0.8, 1.2]))
    (tmp_path / "speed.json").write_text(benchmarks("speed", "--json").out)
    rates, errors = Scores.read(tmp_path / "speed.json").tables

    wet, _, dry = (float(row[1]) for row in rates.rows)
    assert dry > wet > 0
    assert [row[0] for row in errors.rows] == ["fitted to the public trials", "published"]
