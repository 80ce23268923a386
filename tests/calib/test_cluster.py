"""`calib run --scheduler` on a real cluster of two worker processes, and what it refuses."""

import json
import os
import shutil
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from distributed import LocalCluster

from calib import spread as of_spread
from calib.batch import run_all
from session.lock import HOLDER
from tests.calib.door import Front, assert_reports, hurried, lasting


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    """Two processes of one thread each."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as started:
        client = started.get_client()
        client.run(hurried)
        client.register_worker_callbacks(hurried)  # of those that take the place of killed ones
        yield started


@pytest.fixture
def pair(fresh_session: Path, tmp_path: Path) -> list[Path]:
    """Two sessions without results."""
    return [Path(shutil.copytree(fresh_session, tmp_path / name)) for name in ("first", "second")]


def test_results_are_those_of_one_process_to_the_last_digit(
    calib: Front, cluster: LocalCluster, pair: list[Path], finished: Path
) -> None:
    outcome = calib("run", *pair, "--effort", "quick", "--scheduler", cluster.scheduler_address)
    assert outcome.code == 0, outcome
    for folder in pair:
        assert lasting(folder) == lasting(finished)


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
    for folder in pair:
        assert lasting(folder).items() >= {k: v for k, v in lasting(finished).items() if k != "report.html"}.items()


def test_workers_of_another_version_are_refused(
    calib: Front, cluster: LocalCluster, fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(of_spread, "program_version", lambda: "swimcal 9.9")
    outcome = calib("run", fresh, "--scheduler", cluster.scheduler_address)
    assert_reports(outcome, "the worker is another version", "expected swimcal 9.9", *cluster.scheduler_info["workers"])
    assert not (fresh / "results").exists()
