"""Each piece is done once; a process or worker that dies costs its own piece only."""

import subprocess
import sys
from pathlib import Path

import pytest
from distributed import LocalCluster

from calib import batch as of_spread
from calib.batch import spread
from swimcal.errors import InputError
from tests.calib.children import fatal


def lost(number: int, _why: str) -> int:
    return -number


def test_a_process_that_dies_costs_its_own_piece_only() -> None:
    assert sorted(spread(fatal, [1, 2], lost, jobs=2)) == [-1, 4]


@pytest.mark.long
def test_a_script_needs_no_guard_against_running_itself_again(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("from calib.batch import spread\nprint(sorted(spread(abs, [-1, -2], max, jobs=2)))\n")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert done.stdout == "[1, 2]\n"
    assert not done.stderr


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of_spread, "_PATIENCE_S", 0.2)
    with pytest.raises(InputError, match=r"--scheduler: no scheduler answers there.*tcp://127\.0\.0\.1:1.*dask worker"):
        list(spread(fatal, [0], lost, scheduler="tcp://127.0.0.1:1"))


def test_a_scheduler_without_workers_is_named() -> None:
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=":0") as cluster,
        pytest.raises(InputError, match="no workers"),
    ):
        list(spread(fatal, [0], lost, scheduler=cluster.scheduler_address))
