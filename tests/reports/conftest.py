"""What holds for all tests of reports."""

import pytest
from matplotlib.figure import Figure

from tests.reports.undrawn import undrawn


@pytest.fixture
def words_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of what a report says: its figures are made, and not drawn."""
    monkeypatch.setattr(Figure, "savefig", undrawn)
