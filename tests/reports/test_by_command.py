"""What is forecast from the command alone are next to the other forecasts, and its absence is explained."""

import re

import pytest

from fitting.calibration import Calibration
from reports.report import render_report
from tests.fitting.test_forecast import commanded
from tests.reports.page import Page
from tests.reports.sample import made_context
from tests.reports.undrawn import nothing_drawn

SLOW_M_S = 0.05
"""Measured in the held-out trial; the twin's sweep says a tenth of a metre a second for every hertz."""


def page_of(calibration: Calibration) -> Page:
    return Page(render_report(made_context(calibration)))


@pytest.fixture(scope="module")
def page() -> Page:
    """The beat is 0.75 of the command, so 0.6 Hz instead of the 0.5 Hz that were measured."""
    with nothing_drawn():
        return page_of(commanded(0.8, 0.8 / 0.75, 1.3 / 0.75))


def test_the_error_of_the_forecast_is_next_to_that_of_the_twin(page: Page) -> None:
    error = 1000 * (0.06 - SLOW_M_S)

    assert re.search(rf"slow, held out 0\.500 50\.0 \+5\.0 \S+ \+{error:.1f} ", page.text)
    assert re.search(r"medium, fitted 0\.800 80\.0 \+8\.0 \S+ – ", page.text)
    assert re.search(rf"mean error, held out +5\.0 \S+ {error:.1f} ", page.text)


@pytest.mark.usefixtures("words_alone")
@pytest.mark.parametrize("command", [None, 9.0], ids=["unknown", "beyond the sweep"])
def test_without_it_the_reason_is_reported(command: float | None) -> None:
    page = page_of(commanded(command, 1.0, 1.5))
    reported = "slow: its command is not known" if command is None else "forecast from the command, is outside"

    assert "No forecast from the command of slow:" in page.text
    assert reported in page.text
    assert ("no command" in page.text.split("Of elongated body theory")[0]) == (command is None)
    assert not re.search(r"\bnan\b", page.text)
