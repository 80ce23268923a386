"""Work is done once, wherever it is done, and also when a worker dies over it."""

import os
import signal
from pathlib import Path

import pytest
from distributed import LocalCluster

from benchmarks.spread import spread
from tests.cases import later


def squared(number: int) -> tuple[int, int]:
    return number**2, os.getpid()


def killed_once(marker: str) -> str:
    """Kills the process it runs in, the first time that it is tried."""
    path = Path(marker)
    if not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return path.name


@pytest.mark.parametrize("workers", [1, *later(2)])
def test_every_piece_is_done_once(workers: int) -> None:
    done = list(spread(squared, range(5), workers))
    assert sorted(value for value, _ in done) == [0, 1, 4, 9, 16]
    assert (os.getpid() in {process for _, process in done}) == (workers == 1)


def test_nothing_to_do_is_done() -> None:
    assert list(spread(squared, [])) == []


def test_what_a_killed_worker_leaves_is_done_by_the_other_and_nothing_twice(tmp_path: Path) -> None:
    pieces = [str(tmp_path / str(number)) for number in range(6)]
    for piece in pieces[1:]:
        Path(piece).touch()
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        done = list(spread(killed_once, pieces, scheduler=cluster.scheduler_address))
    assert sorted(done) == [str(number) for number in range(6)]
