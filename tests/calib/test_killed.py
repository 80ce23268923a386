"""Results survive being killed or stopped at any moment, a full disk, and a folder that cannot be written."""

import os
import random
import resource
import shutil
import signal
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import pytest

from calib import cli
from swimcal.stage import HOLDER, session_lock
from tests.calib.door import edit, files_in, hurried, lasting
from tests.calib.forks import forks
from tests.cases import later

_LONGEST_S = 3.0  # from the beginning of the work to a kill: an undisturbed run takes some 2 s


def run(folder: Path, effort: str, most_bytes: int) -> None:
    """`calib run`, with little effort if quick; the system refuses larger files than so many bytes, if any."""
    if most_bytes:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))
    if effort == "quick":
        hurried()
    sys.argv = ["calib", "run", str(folder), "--effort", effort, *(["--until", "fit"] if effort == "quick" else [])]
    said, shown = ((folder / name).open("w") for name in ("said", "shown"))
    with said, shown, redirect_stderr(said), redirect_stdout(shown):
        cli.main()


def started(folder: Path, effort: str = "quick", most_bytes: int = 0) -> ForkServerProcess:
    """The same as a process of its own."""
    process = forks().Process(target=run, args=(folder, effort, most_bytes))
    process.start()
    return process


@pytest.mark.long
@pytest.mark.parametrize("kills", [3, *later(50)])
def test_after_kills_at_random_moments_the_results_are_those_of_an_undisturbed_run(
    finished: Path, fresh_session: Path, tmp_path: Path, kills: int
) -> None:
    expected, folder = lasting(finished), tmp_path / "killed"
    shutil.copytree(fresh_session, folder)
    holder, moments = folder / "results" / HOLDER, random.Random(kills)
    for _ in range(kills):
        holder.unlink(missing_ok=True)
        running = started(folder)
        while not holder.exists() and running.is_alive():  # until the work begins
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, _LONGEST_S))
        running.kill()
        running.join()
        assert lasting(folder).items() <= expected.items()  # whatever is there is whole
    last = started(folder)
    last.join(120)
    assert last.exitcode == 0, (folder / "said").read_text()
    assert lasting(folder) == expected
    assert not [name for name in files_in(folder) if ".part." in name]


def test_ctrl_c_ends_with_130_and_the_same_command_goes_on(fresh: Path) -> None:
    tracks = fresh / "results" / "tracks"
    running, deadline = started(fresh, "full"), time.monotonic() + 60  # it would take minutes
    while not (tracks / "fast.csv").exists():
        assert time.monotonic() < deadline
        assert running.is_alive()
        time.sleep(0.05)
    time.sleep(0.5)  # past the Sobol tables of scipy, which swallow a Ctrl-C while they load
    assert running.pid is not None
    os.kill(running.pid, signal.SIGINT)
    running.join(60)

    said = (fresh / "said").read_text()
    assert running.exitcode == 130
    assert (fresh / "shown").read_text() == ""
    assert "calib: stopped. What was finished is kept" in said
    assert "Traceback" not in said
    assert lasting(fresh).keys() == {"tracks/slow.csv", "tracks/fast.csv"}
    with session_lock(fresh):
        pass


def test_a_full_disk_is_one_clear_error_and_leaves_what_was_there(finished: Path) -> None:
    before = lasting(finished)
    edit(finished / "session.toml", "[fit]", "[fit]\nseed = 7")
    running = started(finished, most_bytes=2000)
    running.join(120)
    said = (finished / "said").read_text()
    assert running.exitcode == 2, said
    assert "cannot be written; found: File too large; expected: a writable folder with space left" in said
    assert "Traceback" not in said
    assert lasting(finished) == before
