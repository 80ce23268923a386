"""The front door, for `calib benchmark`."""

import pytest

from tests.calib.door import Front, front_door


@pytest.fixture
def calib(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Front:
    return front_door(monkeypatch, capsys)
