"""Results survive being killed at any moment, a full disk, and a folder that cannot be written."""

import errno
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from session.lock import HOLDER
from tests.calib.door import ROOT, Front, assert_reports, edit, files_in, lasting
from tests.cases import later

_HURRIED = "from tests.calib.door import hurried; hurried(); from calib.entry import main; main()"
_LONGEST_S = 3.0  # from the beginning of the work to a kill: an undisturbed run takes some 2 s
_FULL = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)); " + _HURRIED


def started(folder: Path, program: str = _HURRIED) -> subprocess.Popen[str]:
    """`calib run` as a process of its own, with little effort."""
    command = [sys.executable, "-c", program, "run", str(folder), "--effort", "quick"]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("kills", [5, *later(50)])
def test_after_kills_at_random_moments_the_results_are_those_of_an_undisturbed_run(
    finished: Path, fresh_session: Path, tmp_path: Path, kills: int
) -> None:
    expected, folder = lasting(finished), tmp_path / "killed"
    shutil.copytree(fresh_session, folder)
    holder, moments = folder / "results" / HOLDER, random.Random(kills)
    for _ in range(kills):
        holder.unlink(missing_ok=True)
        running = started(folder)
        while not holder.exists() and running.poll() is None:  # until the work begins
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, _LONGEST_S))
        running.send_signal(signal.SIGKILL)
        running.communicate()
        assert lasting(folder).items() <= expected.items()  # whatever is there is whole
    last = started(folder)
    _, err = last.communicate(timeout=120)
    assert last.returncode == 0, err
    assert lasting(folder) == expected
    assert not [name for name in files_in(folder) if ".part." in name]


def test_a_full_disk_is_one_clear_error_and_leaves_what_was_there(finished: Path) -> None:
    before = lasting(finished)
    edit(finished / "session.toml", "[fit]", "[fit]\nseed = 7")
    running = started(finished, _FULL)
    out, err = running.communicate(timeout=120)
    assert (running.returncode, out) == (2, "")
    assert "cannot be written; found: File too large; expected: a writable folder with space left" in err
    assert "Traceback" not in err
    assert lasting(finished) == before


@pytest.mark.parametrize("refusal", [errno.ENOSPC, errno.EROFS])
def test_what_the_system_refuses_is_one_clear_error(
    calib: Front, finished: Path, monkeypatch: pytest.MonkeyPatch, refusal: int
) -> None:
    before = lasting(finished)
    edit(finished / "session.toml", "[fit]", "[fit]\nseed = 7")

    def refuse(_descriptor: int) -> None:
        raise OSError(refusal, os.strerror(refusal))

    monkeypatch.setattr(os, "fsync", refuse)
    assert_reports(calib("run", finished, "--effort", "quick"), os.strerror(refusal), "a writable folder with space")
    assert lasting(finished) == before
