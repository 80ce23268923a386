"""Several sessions at a time, here or on a cluster: a broken one stops no other, and the index compares the rest."""

import json
import os
import shutil
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import dask
import pandas as pd
import pytest
from distributed import LocalCluster

import calib as front
from calib import batch as of_spread
from calib.batch import run_all
from calib.stages.diagnosis import DiagnosisStage
from calib.stages.fit import FitStage, PosteriorStage
from swimcal.stage import HOLDER
from tests.calib.door import Front, assert_reports, calibration_of, hurried, lasting
from tests.calib.forks import forks


@pytest.fixture
def broken(fresh_session: Path, tmp_path: Path) -> Path:
    folder = Path(shutil.copytree(fresh_session, tmp_path / "broken"))
    (folder / "session.toml").write_text("nonsense")
    return folder


def test_a_broken_session_stops_no_other(calib: Front, finished: Path, broken: Path) -> None:
    outcome = calib("run", finished, broken, "--effort", "quick", "--until", "fit", "--jobs", "2")
    assert outcome.code == 2
    assert "calib: broken: failed after" in outcome.err
    assert "done after" in outcome.err
    assert f"calib: broken failed: {broken / 'session.toml'}" in outcome.err
    page = (finished.parent / "index.html").read_text()
    assert 'href="' in page
    assert str(broken / "session.toml") in page


def test_the_csv_has_coefficients_with_intervals_and_the_reason_of_what_failed(finished: Path, broken: Path) -> None:
    made = front.report([finished, broken])
    assert list(made.failures) == ["broken"]
    fit = front.fit(finished, "quick", progress=False)
    table = pd.read_csv(made.file.with_suffix(".csv"), index_col="session")
    row = table.loc[fit.session.name]
    assert row.kutta_lift == pytest.approx(fit.coefficients.kutta_lift)
    assert row.kutta_lift_q05 <= row.kutta_lift <= row.kutta_lift_q95
    assert row.twin_marker_error_mm == pytest.approx(fit.data.summary["holdout"].marker_error_mm)  # type: ignore[union-attr]
    assert row.verdict == fit.verdict
    assert "session.toml" in table.loc["broken"].error


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    """Two processes of one thread each."""
    forks()
    method = dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"})
    with method, LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as started:
        client = started.get_client()
        client.run(hurried)
        client.register_worker_callbacks(hurried)  # workers that take the place of killed ones
        yield started


@pytest.fixture
def pair(fresh_session: Path, tmp_path: Path) -> list[Path]:
    """Two sessions without results."""
    return [Path(shutil.copytree(fresh_session, tmp_path / name)) for name in ("first", "second")]


@pytest.mark.long
def test_results_are_those_of_one_process_to_the_last_digit(
    calib: Front, cluster: LocalCluster, pair: list[Path], finished: Path
) -> None:
    outcome = calib("run", *pair, "--effort", "quick", "--until", "fit", "--scheduler", cluster.scheduler_address)
    assert outcome.code == 0, outcome
    for folder in pair:
        assert lasting(folder) == lasting(finished)


def idle(patch: pytest.MonkeyPatch) -> None:
    """Nothing is computed in this process."""
    for stage, makes in ((FitStage, "_calibrate"), (PosteriorStage, "make"), (DiagnosisStage, "make")):
        patch.setattr(stage, makes, lambda *_, **__: pytest.fail("computed here"))


@pytest.mark.long
def test_a_fit_by_a_worker_is_that_of_this_process(
    calib: Front, cluster: LocalCluster, pair: list[Path], finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    idle(monkeypatch)
    outcome = calib("fit", pair[0], "--effort", "quick", "--scheduler", cluster.scheduler_address)
    assert outcome.code == 0, outcome
    assert lasting(pair[0])["calibration.json"] == lasting(finished)["calibration.json"]


@pytest.mark.long
def test_posterior_and_diagnosis_by_a_worker(
    calib: Front, cluster: LocalCluster, fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    idle(monkeypatch)
    for command in ("fit", "posterior", "diagnose"):
        outcome = calib(command, fresh, "--effort", "quick", "--scheduler", cluster.scheduler_address)
        assert outcome.code == 0, outcome


def test_what_fails_at_a_worker_fails_here(calib: Front, cluster: LocalCluster, broken: Path) -> None:
    assert_reports(calib("posterior", broken, "--scheduler", cluster.scheduler_address), "session.toml")


@pytest.mark.long
def test_a_worker_killed_midway_costs_its_own_session_only(
    cluster: LocalCluster, pair: list[Path], finished: Path
) -> None:
    holder = pair[0] / "results" / HOLDER
    with ThreadPoolExecutor(1) as aside:
        running = aside.submit(run_all, pair, "quick", scheduler=cluster.scheduler_address)
        deadline = time.monotonic() + 60
        while not holder.is_file() or not holder.read_bytes():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        os.kill(json.loads(holder.read_bytes())["pid"], signal.SIGKILL)
        assert running.result(120) == {}
    grown = {"report.html", "calibration.json"}  # a run goes on to the posterior, which the fit then holds
    for folder in pair:
        assert lasting(folder).items() >= {k: v for k, v in lasting(finished).items() if k not in grown}.items()
        assert calibration_of(folder)["coefficients"] == calibration_of(finished)["coefficients"]


def test_workers_of_another_version_are_refused(
    calib: Front, cluster: LocalCluster, fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(of_spread, "program_version", lambda: "swimcal 9.9")
    outcome = calib("run", fresh, "--scheduler", cluster.scheduler_address)
    assert_reports(outcome, "the worker is another version", "expected swimcal 9.9", *cluster.scheduler_info["workers"])
    assert not (fresh / "results").exists()
