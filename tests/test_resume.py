"""The plugin of `make test-all`: an interrupted run goes on where it was."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long  # it serves nothing else

ROOT = Path(__file__).resolve().parents[1]
TESTS = """
import os

def test_first():
    pass

def test_second():
    if os.environ.get("KILL"):
        os._exit(1)
    assert not os.environ.get("FAIL")

def test_third():
    pass
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A git repository with three tests, of which the second can be reported to fail or to kill the run."""
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / ".gitignore").write_text(".pytest_cache/\n__pycache__/\n")
    (tmp_path / "test_some.py").write_text(TESTS)
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    return tmp_path


def run_in(project: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-p", "tests.resume", *arguments]
    env = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.run(command, cwd=project, env=env, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("trouble", ["KILL", "FAIL"])
def test_what_passed_before_the_trouble_is_left_out_after_it(project: Path, trouble: str) -> None:
    assert run_in(project, **{trouble: "1"}).returncode == 1
    passed_before = 1 if trouble == "KILL" else 2

    again = run_in(project)

    assert again.returncode == 0, again.stdout
    assert f"{3 - passed_before} passed, {passed_before} deselected" in again.stdout


def test_after_a_whole_run_and_after_an_edit_all_starts_over(project: Path) -> None:
    assert "3 passed" in run_in(project).stdout
    run_in(project, FAIL="1")
    with (project / "test_some.py").open("a") as tests:
        tests.write("\n# another tree\n")

    assert "3 passed" in run_in(project).stdout


def test_processes_share_one_record(project: Path) -> None:
    assert "1 failed, 2 passed" in run_in(project, "-n", "2", FAIL="1").stdout

    again = run_in(project, "-n", "2")

    assert again.returncode == 0, again.stdout
    assert "1 passed" in again.stdout


def test_a_run_with_nothing_left_succeeds(project: Path) -> None:
    run_in(project, FAIL="1")

    assert run_in(project, "-k", "first or third").returncode == 0
