"""A pytest plugin (`-p tests.resume`) for long runs: what already passed on this very tree is left out.

The node ids that passed stand in the cache of pytest, under the fingerprint of the interpreter and of every
file that git would commit. An edit starts over; so does the run after one in which everything passed.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest


def tree_fingerprint(root: Path) -> str:
    """A hash of the interpreter and of the files below `root` that git tracks or would add."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    names = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout.split("\0")
    digest = hashlib.sha256(sys.version.encode())
    for path in (root / name for name in sorted(set(names))):
        if path.is_file():
            digest.update(f"{path}\0{hashlib.sha256(path.read_bytes()).hexdigest()}".encode())
    return digest.hexdigest()


class LeaveOut:
    """Deselects the tests that passed before."""

    def __init__(self, passed: set[str]) -> None:
        self.passed = passed

    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        done = [item for item in items if item.nodeid in self.passed]
        items[:] = [item for item in items if item.nodeid not in self.passed]
        config.hook.pytest_deselected(items=done)


class Resume(LeaveOut):
    """Adds each test that passes to `record`: the fingerprint of its tree, then a node id a line."""

    def __init__(self, record: Path, fingerprint: str) -> None:
        tree, *passed = record.read_text().splitlines() if record.exists() else [""]
        super().__init__(set(passed) if tree == fingerprint else set())
        self.record = record
        self.called: set[str] = set()
        if not self.passed:
            record.write_text(f"{fingerprint}\n")

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tells a process of pytest-xdist what to leave out."""
        node.workerinput["passed"] = sorted(self.passed)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.passed:
            self.called.add(report.nodeid)
        if report.when == "teardown" and report.passed and report.nodeid in self.called:
            with self.record.open("a") as record:
                record.write(f"{report.nodeid}\n")

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        nothing_left = exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and self.passed
        if nothing_left:
            session.exitstatus = pytest.ExitCode.OK
        if nothing_left or exitstatus == pytest.ExitCode.OK:
            self.record.unlink(missing_ok=True)


def pytest_configure(config: pytest.Config) -> None:
    """Registers the plugin: the main process keeps the record, those of pytest-xdist only leave out."""
    if hasattr(config, "workerinput"):
        config.pluginmanager.register(LeaveOut(set(config.workerinput["passed"])))
    else:
        record = config.cache.mkdir("resume") / "passed.txt"
        config.pluginmanager.register(Resume(record, tree_fingerprint(config.rootpath)))
