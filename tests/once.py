"""What several processes of one run of the tests need, and one of them makes."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock


def made_once(temporary: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder in common for all processes of this run, to be copied and not to be written to.

    Args:
        temporary: pytest's own.
        name: of the folder, one for each thing that is made.
        make: called with a folder that is not there yet, by the first that asks; the others wait for it.
    """
    own = temporary.getbasetemp()
    common = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    folder, part = common / f"once-{name}", common / f"once-{name}.part"
    with FileLock(f"{folder}.lock"):
        if not folder.exists():
            shutil.rmtree(part, ignore_errors=True)  # left by one that failed
            make(part)
            part.rename(folder)
    return folder


def copied(session: str) -> Any:
    """A fixture: a copy, of the test's own, of the folder that another fixture makes once."""

    @pytest.fixture
    def copy(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
        return Path(shutil.copytree(request.getfixturevalue(session), tmp_path / "pool"))

    return copy
