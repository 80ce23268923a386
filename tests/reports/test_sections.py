"""Sections say what their data say, and say so when their data are missing."""

import re
from dataclasses import replace

import numpy as np
import pytest

from reports.coefficients import build_coefficients
from reports.first_screen import build_summary
from reports.forecasts import build_forecasts
from reports.report import SECTIONS, SectionBuilder, render_report
from swimcal.robot import load_robot
from tests.reports.page import Page
from tests.reports.sample import made_calibration, made_context, made_published
from tests.reports.undrawn import nothing_drawn


def page_of(
    *only: SectionBuilder,
    names: tuple[str, ...] = ("slow", "medium", "fast"),
    published: bool = False,
    **changes: object,
) -> Page:
    """The report, or only some of its sections."""
    calibration = replace(made_calibration(names), **changes)  # type: ignore[arg-type]
    context = made_context(calibration)
    if published:
        context = replace(context, published=made_published(calibration))
    return Page(render_report(context, only or SECTIONS))


@pytest.fixture(scope="module")
def full() -> Page:
    with nothing_drawn():
        return page_of(published=True)


@pytest.mark.parametrize(
    "said",
    [
        "which is no part of the exported twin, the speed error is 4.0 instead of 5.0 mm/s.",
        "The twin is worse, but not significantly, than the best simple rule, line in frequency: gain −3.0 mm/s.",
        "corrected twin, after two beats 3.0 12.0 6.0 90",
        "continuation of two beats (baseline) 1.0 9.0 5.0",
        "turning trial 1.7 °/s",
        "wave common session 5 %",
        "only the ratio c_D / β is identifiable",
        "1.63 (EBT, published), 1.15 (EBT, smoothed) and 0.33 (EBT, large amplitude)",
    ],
)
def test_numbers_of_the_fit_stand_with_what_they_are_of(full: Page, said: str) -> None:
    assert said in full.text


def test_bands_that_miss_are_called_too_narrow() -> None:
    made = made_calibration().forecasts
    slow = made.trials["slow"]
    narrow = replace(slow.forecasts["given_frequency"], speed_ci90=(0.9, 1.0))
    trials = {**made.trials, "slow": replace(slow, forecasts={**slow.forecasts, "given_frequency": narrow})}
    page = page_of(build_forecasts, forecasts=replace(made, trials=trials))
    assert "1 of 2 measured speeds are outside their 90 % bands" in page.text


def test_the_published_search_is_next_to_the_fit_and_why_it_differs(full: Page) -> None:
    assert "slender drag 7.8 7.02 to 8.58 3" in full.text
    assert re.search(r"fit trials markers, as tracked \[mm\] [\d.]+ [\d.]+", full.text)
    assert "attributes trim" in full.text
    assert re.search(r"Over all trials \w+ is farthest off", full.text)
    assert "calib fit SESSION --objective published does" in page_of(build_coefficients).text


def test_the_dimensionless_numbers_are_those_of_the_swim(full: Page) -> None:
    """Re = U L / nu of the medium trial: 0.08 m/s over 0.576 m in water of 1e-6 m²/s."""
    robot = load_robot()
    reynolds = 0.08 * robot.length_m * robot.water.density_kg_m3 / robot.water.viscosity_pa_s / 1000

    assert re.search(rf"medium [\d.]+ [\d.]+ {reynolds:.1f} ", full.text)


def test_a_diverged_sweep_is_drawn() -> None:
    calibration = made_calibration()
    lost = {name: np.full(12, np.nan) for name in calibration.sweep.ebt}
    sweep = replace(calibration.sweep, speed_twin=np.full(12, np.nan), ebt=lost)
    page = page_of(build_summary, sweep=sweep)

    assert "The twin diverged at 12 frequencies" in page.text
