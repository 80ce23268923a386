"""Sections say what their data say, and say so when their data are missing."""

import re
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from fitting.evidence import Evidence
from fitting.placement import BoxesOff
from reports import render_report
from reports.sections import (
    SECTIONS,
    coefficients,
    placement,
    speed_sweep,
)
from swimmer import load_robot
from tests.reports.page import Page
from tests.reports.sample import (
    made_calibration,
    made_context,
    made_evidence,
)
from tests.reports.undrawn import nothing_drawn


def page_of(
    *only: ModuleType,
    names: tuple[str, ...] = ("slow", "medium", "fast"),
    evidence: Evidence | None = None,
    **changes: object,
) -> Page:
    """The report, or only some of its sections."""
    calibration = replace(made_calibration(names), **changes)  # type: ignore[arg-type]
    context = replace(made_context(calibration), evidence=evidence)
    return Page(render_report(context, [section.build for section in only] or SECTIONS))


@pytest.fixture(scope="module")
def bare() -> Page:
    """Without evidence."""
    with nothing_drawn():
        return page_of()


@pytest.fixture(scope="module")
def full() -> Page:
    with nothing_drawn():
        return page_of(evidence=made_evidence())


def test_without_evidence_each_section_says_what_was_not_made(bare: Page) -> None:
    assert "The fit was not repeated on other pairs of trials" in bare.text
    assert "Their profiles were not made for this session; `calib run` makes them." in bare.text
    assert "coefficient-profiles" not in bare.ids


def test_every_model_has_its_errors_with_intervals(full: Page) -> None:
    held_out = full.text.split("Speed errors over 1 held-out trial.")[1].split("Elongated body theory has two")[0]

    for label in ("twin", "EBT, published", "EBT, smoothed", "EBT, large amplitude (twin’s tail)"):
        assert re.search(rf"{re.escape(label)} [\d.]+ \([\d.]+ to [\d.]+\)", held_out), label
    assert "With 1 held-out trial the intervals" in full.text


def test_it_says_what_of_the_theory_is_identifiable(full: Page) -> None:
    assert "only their ratio c_D / β is identifiable" in full.text
    assert "1.63 (EBT, published), 1.15 (EBT, smoothed) and 0.33 (EBT, large amplitude)" in full.text


def test_pairs_are_summed_up_with_their_caveats(full: Page) -> None:
    assert (
        "Fitted on each of 3 pairs of swims and asked for the others, the twin is off by 11.0 ± 1.0 mm/s" in full.text
    )
    assert "11.5 mm/s for EBT, large amplitude (the twin is better in 2 of 3)" in full.text
    assert "a search of its own, which knows nothing of this session’s fit" in full.text
    assert "The search of medium with fast was still improving when its iterations ran out." in full.text
    assert "From rest, the twin of slow with fast swims backward" in full.text
    assert "EBT, large amplitude (twin’s tail) 26.0 1.0 25.0 27.0 0 of 3" in full.text
    assert "EBT, published 21.0 1.0 20.0 22.0 0 of 3" in full.text


def test_the_fit_with_boxes_put_right_stands_beside_the_plain_one(full: Page) -> None:
    assert "Every other number of this report belongs to the plain fit" in full.text
    assert "plain 31.0 0.4 7.8 2.8 3.8 0 boxes put right 13.0" in full.text
    assert "medium 1.0 ± 0.3 0.0 ± 0.2 −2.0 ± 0.5 −3.0 ± 0.6 +1.2 1.021" in full.text
    assert "slow 1.0 0.0 −2.0 0.0 0.0 1.021" in full.text
    assert "dorsal fin −20.0 ± 0.8 3.0 ± 0.8" in full.text
    assert "Far from where the robot's description has them: dorsal_fin (-20 mm along, +3 mm across)" in full.text


def test_boxes_that_no_hand_puts_there_are_doubted() -> None:
    evidence = made_evidence()
    far = replace(evidence.placed.trials[1], boxes=BoxesOff(neck_across=0.02))
    trials = (evidence.placed.trials[0], far, evidence.placed.trials[2])
    page = page_of(placement, evidence=replace(evidence, placed=replace(evidence.placed, trials=trials)))

    assert "Trial medium: the boxes of nose and neck would have to be 20 mm off, more than a hand misses" in page.text


def test_the_course_says_what_a_symmetric_twin_does_not_do(full: Page) -> None:
    assert "No trial turns by more than its errors: the robot swims straight" in full.text


def test_profiles_say_how_far_each_coefficient_can_slide(full: Page) -> None:
    """The made parabola rises by a tenth one root away from the best: sqrt(0.0031 / 0.003) = 1.02."""
    found = re.search(r"slender drag ([\d.]+) to ([\d.]+), angular", full.text)

    assert found
    low, high = (np.sqrt(float(end)) for end in found.groups())
    assert low == pytest.approx(np.sqrt(7.8) - 1.02, abs=0.05)
    assert high == pytest.approx(np.sqrt(10.0))


def test_the_best_is_held_against_other_starts_as_it_was_before_its_simplex() -> None:
    fit = made_calibration().fit
    best, other, backward = fit.restarts
    before = replace(best, objective_m=0.0304)
    polished = page_of(
        coefficients, fit=replace(fit, restarts=(best, before, replace(other, objective_m=0.0306), backward))
    )
    alone = page_of(
        coefficients, fit=replace(fit, restarts=(best, before, replace(other, objective_m=0.0309), backward))
    )

    assert "2 starts fit equally well (within 1 % of the best, as it was before Nelder-Mead)" in polished.text
    assert "No other start came within 1 % of it, as it was before Nelder-Mead." in alone.text


def test_the_distance_with_boxes_put_right_is_called_an_upper_bound(full: Page) -> None:
    evidence = made_evidence()
    page = page_of(placement, evidence=replace(evidence, placed=replace(evidence.placed, converged=False)))

    assert "Its distance is an upper bound: the descent starts from the plain fit. Held-out" in full.text
    assert "from the plain fit; it was still improving when its iterations ran out." in page.text


def test_residuals_name_the_farthest_marker(full: Page) -> None:
    assert re.search(r"Over all trials \w+ is farthest off", full.text)


def test_the_dimensionless_numbers_are_those_of_the_swim(full: Page) -> None:
    """Re = U L / nu of the medium trial: 0.08 m/s over 0.576 m in water of 1e-6 m²/s."""
    robot = load_robot()
    reynolds = 0.08 * robot.length_m * robot.water.density_kg_m3 / robot.water.viscosity_pa_s / 1000

    assert re.search(rf"medium [\d.]+ [\d.]+ {reynolds:.1f} ", full.text)


def test_a_diverged_sweep_and_a_search_without_a_trace_are_drawn() -> None:
    calibration = made_calibration()
    lost = {name: np.full(12, np.nan) for name in calibration.sweep.ebt}
    sweep = replace(calibration.sweep, speed_twin=np.full(12, np.nan), ebt=lost)
    page = page_of(speed_sweep, coefficients, sweep=sweep, fit=replace(calibration.fit, trace=()))

    assert "The twin diverged at 12 frequencies" in page.text
    assert "trace" not in page.ids
