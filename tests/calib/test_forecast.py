"""`calib forecast`: forecasts of held-out trials beside simple baselines."""

import json
from pathlib import Path

import numpy as np
import pytest

import calib as front
from tests.calib.door import Front, files_in


def test_held_out_trials_stand_beside_baselines_and_the_fit_is_left_alone(finished: Path, calib: Front) -> None:
    before = files_in(finished)
    shown = calib("forecast", str(finished), "--effort", "quick", "--json")
    assert shown.code == 0
    content = json.loads(shown.out)["forecast"]
    models = content["trials"]["fast"]["forecasts"]
    assert {"twin", "from_command", "line", "power_law", "constant_stride"} <= set(models)
    assert set(content["trials"]["slow"]["forecasts"]) == {"twin", "repeat"}
    after = files_in(finished)
    assert {name for name in after if after[name] != before.get(name)} <= {
        "results/forecast.json",
        "results/.stages.json",
        ".swimcal.lock",
    }


@pytest.fixture
def found(finished: Path) -> front.ForecastResult:
    return front.forecast(finished, "quick", progress=False)


def test_its_first_sentence_says_whether_the_baselines_are_beaten(found: front.ForecastResult) -> None:
    lines = found.summary().splitlines()
    assert len(lines) <= 8
    errors = found.to_frame("errors").speed_error_mm_s
    best = errors[["line", "power_law", "constant_stride"]].min()
    assert found.verdict == ("beats_baselines" if errors["from_command"] < best else "worse_than_baselines")
    assert any(line.startswith("Forecasts of speed from the command") for line in lines)
    assert found.verdict.replace("_", " ") in lines[-1]
    assert lines[0] in found._repr_html_()


def test_its_tables_hold_what_the_file_holds(found: front.ForecastResult) -> None:
    trials = found.to_frame()
    forecast = found.trials["fast"].forecasts["from_command"]
    assert trials.speed["fast", "from_command"] == forecast.speed
    assert forecast.speed_ci90 is not None
    assert forecast.speed_ci90[0] < forecast.speed < forecast.speed_ci90[1]
    assert np.isnan(trials.speed_q05["fast", "line"])
    assert list(found.to_frame("coefficients").index) == list(found.coefficients._fields)
    assert found.to_frame("components").sd["turning"] > 0
    assert len(found.details()) >= len(trials)


def test_it_is_read_and_not_made_again(found: front.ForecastResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swimmer.twin.Twin.simulate", None)
    again = front.forecast(found.session, "quick", progress=False)
    assert again.coefficients == found.coefficients
    assert not again.made
