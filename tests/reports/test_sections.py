"""Sections say what their data say, and say so when their data are missing."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from fitting.calibration import Calibration
from fitting.structure import Source, Structure
from reports.first_screen import build_summary
from reports.forecasts import build_forecasts
from reports.report import SectionBuilder, render_report
from reports.robot import build_structure
from reports.words import counted, in_mm, listed, percent, shown, significant
from swimcal.robot import load_robot
from tests.fitting.test_forecast import commanded
from tests.reports.page import Page, nothing_drawn
from tests.reports.sample import made_calibration, made_context, made_published


def page_of(only: SectionBuilder, **changes: object) -> Page:
    """One section of the report."""
    return Page(render_report(made_context(replace(made_calibration(), **changes)), (only,)))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def full() -> Page:
    with nothing_drawn():
        return Page(render_report(replace(made_context(), published=made_published(made_calibration()))))


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
    assert "1 of 2 forecasts of held-out speeds, from the frequency and from two beats, miss by more than" in page.text


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


SLOW_M_S = 0.05
"""Measured in the held-out trial; the twin's sweep says a tenth of a metre a second for every hertz."""


def of_calibration(calibration: Calibration) -> Page:
    return Page(render_report(made_context(calibration)))


@pytest.fixture(scope="module")
def by_command() -> Page:
    """The beat is 0.75 of the command, so 0.6 Hz instead of the 0.5 Hz that were measured."""
    with nothing_drawn():
        return of_calibration(commanded(0.8, 0.8 / 0.75, 1.3 / 0.75))


def test_the_error_of_the_forecast_is_next_to_that_of_the_twin(by_command: Page) -> None:
    error = 1000 * (0.06 - SLOW_M_S)

    assert re.search(rf"slow, held out 0\.500 50\.0 \+5\.0 \S+ \+{error:.1f} ", by_command.text)
    assert re.search(r"medium, fitted 0\.800 80\.0 \+8\.0 \S+ – ", by_command.text)
    assert re.search(rf"mean error, held out +5\.0 \S+ {error:.1f} ", by_command.text)


@pytest.mark.long
@pytest.mark.usefixtures("words_alone")
@pytest.mark.parametrize("command", [None, 9.0], ids=["unknown", "beyond the sweep"])
def test_without_it_the_reason_is_reported(command: float | None) -> None:
    by_command = of_calibration(commanded(command, 1.0, 1.5))
    reported = "slow: its command is not known" if command is None else "forecast from the command, is outside"

    assert "No forecast from the command of slow:" in by_command.text
    assert reported in by_command.text
    assert ("no command" in by_command.text.split("Of elongated body theory")[0]) == (command is None)
    assert not re.search(r"\bnan\b", by_command.text)


@pytest.mark.parametrize("nothing", [None, math.nan, math.inf])
def test_what_is_not_known_is_a_dash(nothing: float | None) -> None:
    assert {shown(nothing), significant(nothing), in_mm(nothing), percent(nothing)} == {"–"}


def test_minus_is_a_minus_and_zero_has_no_sign() -> None:
    assert [shown(-1.25, 2), shown(-0.001, 1), shown(0.04, 1, signed=True)] == ["−1.25", "0.0", "0.0"]
    assert in_mm(0.0031, signed=True) == "+3.1"


def test_a_share_is_whole_only_when_nothing_is_missing() -> None:
    assert [percent(1.0), percent(0.99999), percent(0.5), percent(0.0)] == ["100 %", "99.9 %", "50.0 %", "0 %"]


def test_lists_read_as_sentences() -> None:
    assert [listed([]), listed(["a"]), listed(["a", "b", "c"])] == ["", "a", "a, b and c"]
    assert listed(list("abcdefgh"), most=3) == "a, b, c and 5 more"
    assert [counted(1, "trial"), counted(0, "trial")] == ["1 trial", "0 trials"]


MEASURED = (
    Source("hinge_stiffness", 0.6512, "N m/rad", 0.0021, ("decay_1", "decay_2"), ""),
    Source("hinge_damping", 0.0213, "N m s/rad", 0.0004, ("decay_1", "decay_2"), ""),
    Source("crank_arm", 0.03842, "m", 0.00006, ("dry_slow",), ""),
)


def of(changed: Structure):  # type: ignore[no-untyped-def]
    return made_context(replace(made_calibration(), structure=changed))


def test_what_was_measured_stands_with_its_error_and_its_trials() -> None:
    section = build_structure(of(replace(made_calibration().structure, sources=MEASURED)))
    (table,) = section.blocks

    assert table.caption.endswith("All numbers were measured in this session.")  # type: ignore[union-attr]
    assert table.rows[:3] == (  # type: ignore[union-attr]
        ("hinge stiffness", "0.651 ± 0.002", "N m/rad", "decay_1 and decay_2"),
        ("hinge damping", "21.3 ± 0.4", "mN m s/rad", "decay_1 and decay_2"),
        ("crank arm", "38.42 ± 0.06", "mm", "dry_slow"),
    )
