"""The front door of the benchmarks."""

import pytest

from benchmarks.__main__ import main
from tests.calib.door import Front, front_door


@pytest.fixture
def benchmarks(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Front:
    """`python -m benchmarks` within this process."""
    return front_door(monkeypatch, capsys, main)
