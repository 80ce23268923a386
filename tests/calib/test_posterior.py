"""`calib posterior`: what it writes, when it goes on, when it is made again, when it refuses."""

import json
from pathlib import Path

import arviz
import numpy as np
import pytest

from fitting.posterior import sampling
from tests.calib.door import (
    Front,
    assert_public_form,
    assert_reports,
    calibration_of,
    little_posterior,
    results_in,
)

QUICK = ("--effort", "quick")


@pytest.fixture(autouse=True)
def _little(monkeypatch: pytest.MonkeyPatch) -> None:
    little_posterior(monkeypatch)


def test_the_calibration_gains_the_posterior_and_nothing_else(finished_session: Path, sampled_session: Path) -> None:
    before, after = calibration_of(finished_session), calibration_of(sampled_session)
    posterior = after["posterior"]

    assert after | {"posterior": {}} == before
    assert isinstance(posterior, dict)
    assert list(posterior) == list(before["coefficients"])  # type: ignore[call-overload]
    for marginal in posterior.values():
        assert set(marginal) == {"mean", "sd", "q05", "q95", "ess_bulk", "r_hat", "determined"}
        assert 0 <= marginal["q05"] < marginal["mean"] < marginal["q95"] <= 10
    assert_public_form(sampled_session)


def test_arviz_reads_draws_statistics_features_and_what_they_were_made_with(sampled_session: Path) -> None:
    data = arviz.from_netcdf(sampled_session / "results" / "posterior.nc", engine="h5netcdf")
    reported = calibration_of(sampled_session)["posterior"]

    assert {"posterior", "sample_stats", "observed_data"} <= set(data.groups())
    assert float(data.posterior["kutta_lift"].mean()) == pytest.approx(reported["kutta_lift"]["mean"])  # type: ignore[index]
    assert 0 < float(data.sample_stats["acceptance_rate"]) < 1
    assert data.observed_data["trial"].to_numpy().tolist() == ["slow"]
    assert data.observed_data["forward_speed_m_s"].sel(trial="slow").frequency_hz == pytest.approx(0.8, rel=0.02)
    assert data.attrs["effort"] == "quick"
    assert data.attrs["seed"] == 0
    assert data.attrs["model_sha256"] == calibration_of(sampled_session)["model_sha256"]
    assert "uniform from 0 to 10" in data.attrs["prior"]
    assert "swimcal" in data.attrs["program"]


def test_a_posterior_that_stands_is_not_made_again(calib: Front, sampled: Path) -> None:
    before = results_in(sampled)
    outcome = calib("posterior", sampled, *QUICK)

    assert outcome.code == 0
    assert outcome.out.splitlines()[-1] == str(sampled / "results" / "posterior.nc")
    assert "Kutta lift" in outcome.out
    assert len(outcome.out.splitlines()) <= 8
    assert results_in(sampled) == before


@pytest.mark.long
def test_it_refuses_to_report_chains_that_disagree(
    calib: Front, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sampling, "R_HAT", 0.5)
    monkeypatch.setattr(sampling, "_LONGEST", sampling._CHUNK)
    before = calibration_of(finished)
    outcome = calib("posterior", finished, *QUICK)

    assert_reports(outcome, "posterior.nc: not written", "R-hat", "wanted 0.5", "leave out faulty ones")
    assert calibration_of(finished) == before
    assert not (finished / "results" / "posterior.nc").exists()


@pytest.mark.long
def test_run_with_full_effort_says_a_refusal_beside_the_report(
    calib: Front, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sampling, "R_HAT", 0.5)
    monkeypatch.setattr(sampling, "_LONGEST", sampling._CHUNK)
    outcome = calib("run", finished)

    assert outcome.code == 0
    assert "sampled too little" in outcome.out
    assert outcome.out.splitlines()[-1] == str(finished / "results" / "report.html")


def test_what_is_said_of_it_stands_in_a_file_of_its_own(sampled_session: Path) -> None:
    said = json.loads((sampled_session / "results" / "posterior.json").read_text())
    sweep, trials = said["sweep"], said["trials"]

    assert said["effort"] == "quick"
    assert [(trial["name"], trial["role"]) for trial in trials] == [("slow", "fit"), ("fast", "holdout")]
    for trial in trials:
        assert trial["outer"][0] < trial["inner"][0] <= trial["inner"][-1] < trial["outer"][-1]
        assert 0 <= trial["forecast"]["inside"] <= 1
    forecasts = said["forecasts"]["trials"]["fast"]["forecasts"]
    assert forecasts.keys() == {"posterior", "line", "power_law", "constant_stride"}
    assert forecasts["posterior"] == trials[1]["forecast"]
    assert np.all(np.diff(sweep["outer"], axis=0) >= 0)
    assert np.all(np.diff(sweep["inner"], axis=0) >= 0)
    assert np.all(np.array(sweep["sd"]) <= np.array(sweep["sd_now"]) * (1 + 1e-9))


@pytest.mark.long
def test_the_report_is_made_again_with_the_posterior(calib: Front, sampled: Path) -> None:
    report = sampled / "results" / "report.html"
    before = report.stat().st_mtime_ns
    assert calib("report", sampled).code == 0
    after = report.stat().st_mtime_ns
    assert after > before
    assert calib("report", sampled).code == 0
    assert report.stat().st_mtime_ns == after
