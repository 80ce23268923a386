"""Sections say what their data say, and say so when their data are missing."""

import re
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from fitting import Evidence
from fitting.placement import BoxesOff
from reports import render_report
from reports.sections import (
    SECTIONS,
    coefficients,
    other_pairs,
    placement,
    residuals,
    speed_sweep,
    tail_beat,
    trials,
)
from swimmer import load_robot
from tests.reports.page import Page
from tests.reports.sample import (
    made_calibration,
    made_context,
    made_evidence,
    made_trial,
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
    assert "Their profiles were not made for this session." in bare.text
    assert "coefficient-profiles" not in bare.ids


def test_with_two_swims_there_is_no_other_pair() -> None:
    page = page_of(other_pairs, names=("medium", "fast"), evidence=made_evidence(("medium", "fast")))

    assert "With fewer than three swims there is no other pair of fit trials to try." in page.text
    assert "pair-errors" not in page.ids


@pytest.mark.usefixtures("words_alone")
def test_a_single_trial_fills_every_section() -> None:
    page = page_of(names=("fast",), evidence=made_evidence(("fast",)))

    assert "Speed errors over 1 fit trial." in page.text
    assert "the errors below are those of the fit and flatter every model" in page.text
    assert "residual-markers" in page.ids
    assert not re.search(r"\bnan\b", page.text)


def test_every_model_has_its_errors_with_intervals(full: Page) -> None:
    held_out = full.text.split("Speed errors over 1 held-out trial.")[1].split("Elongated body theory has two")[0]

    for label in ("twin", "EBT, published", "EBT, smoothed", "EBT, large amplitude (twin’s tail)"):
        assert re.search(rf"{re.escape(label)} [\d.]+ \([\d.]+ to [\d.]+\)", held_out), label
    assert "With 1 held-out trial the intervals" in full.text


def test_it_says_what_of_the_theory_is_identifiable(full: Page) -> None:
    assert "only their ratio c_D / β is identifiable" in full.text
    assert "1.63 (EBT, published), 1.15 (EBT, smoothed) and 0.33 (EBT, large amplitude)" in full.text


def test_where_every_marker_is_lost_in_some_trial_none_is_singled_out() -> None:
    blind = []
    for i, trial in enumerate(made_calibration().trials):
        weight = trial.measured.weight.copy()
        weight[:, i::3] = 0.0
        blind.append(replace(trial, measured=replace(trial.measured, weight=weight)))
    page = page_of(residuals, trials=tuple(blind))

    assert "In no trial do all markers have samples that count, so no marker is singled out." in page.text
    assert "is farthest off" not in page.text


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


def test_theory_that_predicts_nothing_is_a_dash() -> None:
    evidence = made_evidence()
    pairs = tuple(replace(p, speed_mae={**p.speed_mae, "large": np.nan}) for p in evidence.pairs)
    page = page_of(other_pairs, evidence=replace(evidence, pairs=pairs))

    assert "– mm/s for EBT, large amplitude (the twin is better in 0 of 3)" in page.text
    assert not re.search(r"\bnan\b", page.text)


def test_the_fit_with_boxes_put_right_stands_beside_the_plain_one(full: Page) -> None:
    assert "Every other number of this report belongs to the plain fit" in full.text
    assert "plain 31.0 0.4 7.8 2.8 3.8 0 one turn a trial 27.0 0.5 7.8 2.8 3.8 0 boxes put right 13.0" in full.text
    assert "medium 1.0 ± 0.3 0.0 ± 0.2 −2.0 ± 0.5 −3.0 ± 0.6 +1.2 1.021 +1.1" in full.text
    assert "slow 1.0 0.0 −2.0 0.0 0.0 1.021 –" in full.text
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


def test_a_large_yaw_is_doubted() -> None:
    evidence = made_evidence()
    page = page_of(placement, evidence=replace(evidence, yaw=replace(evidence.yaw, yaw_rad={"medium": -0.3})))

    assert "A turn alone of more than 10° (medium) is more than a misplaced box explains" in page.text


def test_profiles_say_how_far_each_coefficient_can_slide(full: Page) -> None:
    """The made parabola rises by a tenth one root away from the best: sqrt(0.0031 / 0.003) = 1.02."""
    found = re.search(r"slender drag ([\d.]+) to ([\d.]+), angular", full.text)

    assert found
    low, high = (np.sqrt(float(end)) for end in found.groups())
    assert low == pytest.approx(np.sqrt(7.8) - 1.02, abs=0.05)
    assert high == pytest.approx(np.sqrt(10.0))


@pytest.mark.usefixtures("words_alone")
def test_a_start_that_fits_widens_the_range_a_coefficient_can_slide_over() -> None:
    """Beyond a rise: the first profile lies high where a start ended at 6.25, within a tenth of the best."""
    evidence = made_evidence()
    height = np.where(evidence.profiles.value > 2.0, 0.05, evidence.profiles.profile_m)
    end = np.array([made_calibration().coefficients._replace(blunt_drag=6.25)])
    profiles = replace(evidence.profiles, profile_m=height, restart=end, restart_m=np.array([0.032]))
    page = page_of(coefficients, evidence=replace(evidence, profiles=profiles))
    found = re.search(r"blunt drag ([\d.]+) to ([\d.]+), slender", page.text)

    assert found
    assert float(found[2]) > 6.25
    assert "profiles are upper bounds, so the true ranges may be wider" in page.text


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


def test_the_distance_with_a_free_yaw_is_called_an_upper_bound(full: Page) -> None:
    evidence = made_evidence()
    page = page_of(placement, evidence=replace(evidence, yaw=replace(evidence.yaw, converged=False)))

    assert "Their distances are upper bounds: the descent starts from the plain fit. Held-out" in full.text
    assert "from the plain fit; with one turn it was still improving when its iterations ran out." in page.text


def test_residuals_name_the_farthest_marker(full: Page) -> None:
    assert re.search(r"Over all trials \w+ is farthest off", full.text)


def test_a_marker_flagged_too_often_is_left_out_of_the_wave() -> None:
    trial = made_trial(load_robot(), "fast")
    weight = trial.measured.weight.copy()
    weight[:150, -1] = 0.0
    lost = replace(trial, measured=replace(trial.measured, weight=weight))
    page = page_of(tail_beat, residuals, trials, trials=(lost,))

    assert "Too often flagged for its beat to be told: caudal_fin of fast" in page.text
    assert "it is not known for any trial here" in page.text
    assert "Less than half of the scored samples count for caudal_fin of fast" in page.text


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
