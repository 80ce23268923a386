"""What holds for all tests of reports."""

from collections.abc import Iterator

import pytest

from tests.reports.page import nothing_drawn


@pytest.fixture
def words_alone() -> Iterator[None]:
    """For tests of what a report says: its figures are made, and not drawn."""
    with nothing_drawn():
        yield
