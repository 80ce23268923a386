"""Forecasts are next to simple baselines in file, frames and sentences, and the published search next to the fit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import calib as front
from fitting.forecast import Scatter
from fitting.session_forecast import Forecast, ForecastTrial, SessionForecast
from reports.words import compared_with_best, holds_against_rules, misses
from swimcal.flags import Flag
from tests.calib.door import Front, calibration_of, files_in
from tests.swimcal.sample import FISHSIM, needs_fishsim


@pytest.fixture
def found(finished: Path) -> front.FitResult:
    fit = front.fit(finished, "quick", progress=False)
    assert isinstance(fit, front.FitResult)
    return fit


def test_every_forecast_of_the_file_is_next_to_baselines(finished: Path) -> None:
    trials = calibration_of(finished)["forecasts"]["trials"]
    assert {"twin", "given_frequency", "line", "power_law", "constant_stride", "ebt_large"} <= set(
        trials["fast"]["forecasts"]
    )
    assert {"twin", "repeat"} <= set(trials["slow"]["forecasts"])
    assert "line" not in trials["slow"]["forecasts"]


@pytest.mark.parametrize(
    ("others", "how"),
    [
        ((5.0, 5.1, 4.9), "better than"),
        ((3.0, 9.0, 0.0), "better, but not significantly, than"),
        ((0.0, 5.0, -0.5), "worse, but not significantly, than"),
        ((0.9, 1.0, 1.1), "worse than"),
        ((1.9, 2.12, 2.0), "as good as"),
    ],
)
def test_outcomes_are_told_apart(others: tuple[float, ...], how: str) -> None:
    """The twin is off by 2 mm/s in each of three trials, the line by these."""
    trials = {
        str(i): ForecastTrial("holdout", 1.0, 0.1, {"twin": Forecast(0.102), "line": Forecast(0.1 + other / 1000)})
        for i, other in enumerate(others)
    }
    assert f"The twin is {how} the best simple rule" in compared_with_best(SessionForecast(Scatter(), trials))


@pytest.mark.parametrize(
    ("twin", "how"), [(0.104, ""), (0.12, "20 % too fast"), (0.8, "far too fast"), (-0.1, "going the other way")]
)
def test_a_twin_that_misses_its_fit_trials_says_how(twin: float, how: str) -> None:
    said = misses(SessionForecast(Scatter(), {"f": ForecastTrial("fit", 1.0, 0.1, {"twin": Forecast(twin)})}))
    assert how in said
    assert bool(how) == bool(said)


@given(
    speeds=st.lists(st.floats(0.03, 0.3), min_size=2, max_size=5),
    sd=st.floats(0.005, 0.05),
    off=st.floats(-1.5, 1.5),
    rule=st.floats(0.015, 0.1),
)
def test_an_error_of_the_scale_is_not_the_twins(speeds: list[float], sd: float, off: float, rule: float) -> None:
    """The twin swims as the robot, every measured speed is off by the scale's error, the line by that and its own."""
    trials = {
        str(i): ForecastTrial(
            "holdout",
            1.0,
            (1 + off * sd) * speed,
            {"twin": Forecast(speed), "line": Forecast((1 + off * sd) * (1 + rule) * speed)},
        )
        for i, speed in enumerate(speeds)
    }
    forecasts = SessionForecast(Scatter(), trials, sd)
    gain = forecasts.gain_of_twin("line")
    assert holds_against_rules(forecasts)
    assert gain.interval is not None
    assert gain.interval[1] > 0
    if gain.mean < -1e-4:
        assert "worse, but not significantly" in compared_with_best(forecasts)
        assert "the scale of all measured speeds" in compared_with_best(forecasts)


@pytest.mark.parametrize(("twin", "as_good"), [(0.9, True), (1.9, True), (2.1, False), (8.0, False)])
def test_a_twin_as_good_as_speeds_are_measured_is_not_worse_than_a_better_rule(twin: float, as_good: bool) -> None:
    """Speeds of 100 mm/s whose scale is known to 2 %; the twin is off by so many mm/s either way, the line by 0.1."""
    trials = {
        sign: ForecastTrial("holdout", 1.0, 0.1, {"twin": Forecast(0.1 + by * twin / 1000), "line": Forecast(0.1001)})
        for sign, by in (("up", 1), ("down", -1))
    }
    assert holds_against_rules(SessionForecast(Scatter(), trials, 0.02)) == as_good


def test_a_verdict_is_good_only_where_there_is_no_caveat(found: front.FitResult) -> None:
    *_, caveat, verdict = found.summary().splitlines()
    assert (caveat == "No caveat.") == ("without a caveat" in verdict)
    clean = {name: replace(trial, flags=()) for name, trial in found.trials.items()}
    flagged = {**clean, "slow": replace(clean["slow"], flags=(Flag("frequency_off_command"),))}
    without, with_one = (replace(found, data=replace(found.data, flags=(), trials=each)) for each in (clean, flagged))
    assert "No caveat." in without.summary()
    assert with_one.verdict != "good"
    if found.verdict != "worse_than_baseline":
        assert without.verdict == "good"


def test_its_frames_hold_what_the_file_holds(found: front.FitResult) -> None:
    frame = found.to_frame("forecasts")
    forecast = found.forecasts.trials["fast"].forecasts["given_frequency"]
    assert frame.speed["fast", "given_frequency"] == forecast.speed
    assert forecast.speed_ci90 is not None
    assert forecast.speed_ci90[0] < forecast.speed < forecast.speed_ci90[1]
    assert np.isnan(frame.speed_q05["fast", "line"])
    assert found.to_frame("components").sd["turning"] > 0
    coefficients = found.to_frame("coefficients")
    assert (coefficients.fit_q05 <= coefficients.value).all()
    assert (coefficients.value <= coefficients.fit_q95).all()


@pytest.mark.long
def test_the_published_search_leaves_the_fit_alone_and_is_made_once(finished: Path, calib: Front) -> None:
    fit = (finished / "results" / "calibration.json").read_bytes()
    assert calib("fit", finished, "--effort", "quick", "--objective", "published").code == 0
    assert (finished / "results" / "calibration.json").read_bytes() == fit
    published = finished / "results" / "published.json"
    before = files_in(finished)["results/published.json"]
    assert calib("fit", finished, "--effort", "quick", "--objective", "published").code == 0
    assert files_in(finished)["results/published.json"] == before
    again = front.fit(finished, "quick", progress=False)
    assert isinstance(again, front.FitResult)
    reported = json.loads(published.read_text())["fit"]["coefficients"]
    assert again.to_frame("coefficients").published.to_dict() == reported


@pytest.mark.long
@needs_fishsim
def test_two_beats_of_the_real_robot_tell_where_its_markers_go(tmp_path: Path) -> None:
    """At most 20 mm as tracked and 10 mm relative to the nose, over the three held-out trials."""
    fit = front.fit(front.new_session(tmp_path / "pool", from_fishsim=FISHSIM), "quick", progress=False)
    assert isinstance(fit, front.FitResult)
    assert len(fit.forecasts.held_out) == 3
    assert fit.forecasts.mean("after_two_beats", "marker_error_mm") < 20
    assert fit.forecasts.mean("after_two_beats", "shape_error_mm") < 10
