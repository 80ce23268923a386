import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from swimcal.errors import SessionLocked
from swimcal.stage import session_lock

HOLD = """
import pathlib, sys, time, swimcal.stage
with swimcal.stage.session_lock(pathlib.Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    root = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_a_second_process_is_given_the_holder_of_the_lock(tmp_path: Path, holder: subprocess.Popen[str]) -> None:
    message = rf"its lock held by process {holder.pid} on .+, since 20.+Wait for that run, or end it"
    with pytest.raises(SessionLocked, match=message), session_lock(tmp_path):
        raise AssertionError("entered")


def test_a_killed_run_does_not_block_the_next(tmp_path: Path, holder: subprocess.Popen[str]) -> None:
    holder.kill()
    holder.wait()
    with session_lock(tmp_path):
        pass


def test_the_lock_is_free_again_after_the_block_also_when_it_fails(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), session_lock(tmp_path):
        raise RuntimeError
    with session_lock(tmp_path), pytest.raises(SessionLocked), session_lock(tmp_path):
        raise AssertionError("entered")
    assert not (tmp_path / "results" / ".holder.json").exists()
