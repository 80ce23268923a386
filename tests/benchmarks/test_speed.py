"""`python -m benchmarks speed`: ratios of one run, and what the step costs."""

import json

import numpy as np
import pytest

from benchmarks import speed
from tests.calib.door import Front


@pytest.mark.long
def test_the_step_costs_next_to_nothing_in_accuracy() -> None:
    error = speed._measure_step_error("a twin that swims like the robot", speed.FITTED)

    assert error.marker_mean_mm <= 0.2
    assert error.marker_mean_mm <= error.marker_rms_mm <= error.marker_max_mm
    assert error.speed <= 0.02


@pytest.mark.long
def test_the_benchmark_reports_ratios_of_one_run(benchmarks: Front, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "_REPEATS", 1)
    monkeypatch.setattr(speed, "FREQUENCIES_HZ", np.array([0.8, 1.2]))
    reported = json.loads(benchmarks("speed", "--json").out)

    assert reported["fluid_cost"] == pytest.approx(reported["real_time_without_fluid"] / reported["real_time_one_core"])
    assert reported["scaling"] == pytest.approx(reported["real_time_all_cores"] / reported["real_time_one_core"])
    assert reported["fluid_cost"] > 1
    assert reported["cores"] >= 1
    assert all(error["coefficients"]["kutta_lift"] > 0 for error in reported["step_errors"])
