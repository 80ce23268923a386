"""The first screen prints the answers that the end of a run prints, and a swim that moves where it may."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fitting.calibration_file import calibration_result
from reports.answers import HowFarOff, HowSure, Interval, TwinErrors, film_next, how_far_off, use_of_named
from reports.caveats import fit_caveats
from reports.context import ReportContext
from reports.first_screen import build_summary, representative, swim_from_above
from reports.report import render_report
from reports.words import in_mm
from swimcal.flags import Flag
from swimcal.robot import load_robot
from tests.reports.diagnoses import made_diagnosed
from tests.reports.page import Page
from tests.reports.posteriors import made_summary
from tests.reports.sample import made_calibration, made_context

ROBOT = load_robot()


@pytest.fixture(scope="module")
def context() -> ReportContext:
    return replace(made_context(), posterior=made_summary(), diagnosed=made_diagnosed("named"))


def test_every_number_of_the_answers_is_on_the_first_screen(context: ReportContext) -> None:
    page, answers = Page(render_report(context, (build_summary,))), context.answers
    off, missing = answers.how_far_off, answers.missing
    assert off.held_out is not None
    assert missing is not None
    said = [off.held_out.size, off.compared, answers.how_sure.verdict, missing.how_far, answers.next_step]
    said += [f"{in_mm(error)} mm/s" for error in off.beside.values()]
    said += [one.text for one in answers.how_sure.intervals.values()]
    said += [*answers.caveats, f"{len(answers.caveats)} caveats"]
    assert [text for text in said if text not in page.text] == []


def test_means_are_over_the_trials_that_every_model_tells(context: ReportContext) -> None:
    """A held-out trial without a theory's speed is left out of every mean, and counted."""
    found = context.calibration.forecasts
    slow = found.trials["slow"]
    silent = {**slow.forecasts, "ebt_published": replace(slow.forecasts["ebt_published"], speed=np.nan)}
    twice = replace(found, trials={**found.trials, "other": replace(slow, forecasts=silent)})
    off = how_far_off(twice).held_out
    assert off is not None
    assert (off.trials, off.of) == (1, 2)
    assert off.over("held-out") == "1 of 2 held-out trials"


def test_the_swim_is_that_of_a_held_out_trial_to_scale() -> None:
    trial = representative(made_calibration().trials, ROBOT)
    assert trial is not None
    assert trial.measured.role == "holdout"
    drawn = swim_from_above(trial, ROBOT)
    bar = float(re.findall(r'd="M4 [\d.]+h([\d.]+)"', drawn)[0])
    noses = [float(x) for x in re.findall(r'class="still" d="M([\d.]+) ', drawn)][::2]  # one of each filmed outline
    frames = np.flatnonzero(trial.measured.kept)
    moved = trial.measured.position_m[frames[-1]] - trial.measured.position_m[frames[0]]
    way = moved.mean(axis=0)
    swum = float(moved[trial.measured.markers.index("nose")] @ way / np.hypot(*way))
    assert (noses[0] - noses[-1]) / bar * 0.1 == pytest.approx(swum, abs=0.01)


def test_a_trial_of_which_too_little_was_seen_is_not_drawn() -> None:
    trial = made_calibration().trials[0]
    tracks = trial.measured.tracks.copy(deep=True)
    tracks["position_pool"] = tracks.position_pool * np.nan
    assert swim_from_above(replace(trial, measured=replace(trial.measured, tracks=tracks)), ROBOT) == ""


@pytest.mark.parametrize(
    ("theory_mm_s", "said"),
    [(1.0, "worse than"), (4.0, "about as good as"), (9.0, "better than")],
)
def test_the_twin_is_compared_with_elongated_body_theory(theory_mm_s: float, said: str) -> None:
    held_out = TwinErrors(3, 3, 0.0044, 8.1, 0.148, 3)
    off = HowFarOff(None, held_out, {"ebt_published": theory_mm_s / 1000}, "", "", "")
    assert off.beside_theory == f"{said} elongated body theory ({theory_mm_s:.1f} mm/s)"
    assert any(off.beside_theory in text for text in off.sentences)


def test_held_out_speeds_outside_the_predicted_band_are_counted_beside_it(context: ReportContext) -> None:
    summary_of = made_summary()
    held_out = [trial for trial in summary_of.trials if trial.role == "holdout"]
    missed = tuple(
        replace(trial, outer=trial.outer + 1.0) if trial in held_out[:1] else trial for trial in summary_of.trials
    )
    inside = sum(trial.speed_inside for trial in held_out[1:])
    answers = replace(context, posterior=replace(summary_of, trials=missed)).answers
    assert answers.how_sure.in_band == (inside, len(held_out))
    page = Page(render_report(replace(context, posterior=replace(summary_of, trials=missed)), (build_summary,)))
    assert f"{inside} of {len(held_out)} held-out speed" in page.text
    assert answers.how_sure.band in answers.how_sure.sentences


def test_an_exported_value_outside_its_interval_is_marked_and_rejected_twins_are_told() -> None:
    inside, outside = Interval(0.41, 0.40, 0.42, True), Interval(0.36, 0.40, 0.42, True)
    assert inside.text == "0.41 (0.40 to 0.42)"
    assert outside.text == "0.40 to 0.42 (exported: 0.36)"
    sure = HowSure({"blunt_drag": inside}, True)
    assert sure.verdict == "All five coefficients are determined."
    assert "likelier ones do not" in replace(sure, rejected=True).verdict


def test_what_casts_doubt_on_every_number_is_the_first_caveat() -> None:
    found = calibration_result(made_calibration())
    first, second, *_ = fit_caveats(replace(found, flags=(Flag("restarts_disagree", message="another"), *found.flags)))
    assert first.startswith("slow: the swim frequency differs from the command")
    assert second == "Another."


def test_a_swim_that_would_tell_little_is_not_asked_for() -> None:
    summary = made_summary()
    assert film_next(summary, None).startswith("One more swim")
    assert "Hz, if the motor turns so fast: it narrows" in film_next(summary, None, fastest_hz=0.1)
    assert "if the motor" not in film_next(summary, None, fastest_hz=9.0)
    sweep = summary.sweep
    little = replace(sweep, sd=np.broadcast_to(0.95 * sweep.sd_now, sweep.sd.shape))
    assert film_next(replace(summary, sweep=little), None) == ""


@pytest.mark.usefixtures("words_alone")
@pytest.mark.parametrize(("result", "untrue"), [("posterior", "was not sampled"), ("diagnosis", "not searched")])
def test_a_result_that_cannot_be_read_is_told_by_its_file(result: str, untrue: str) -> None:
    page = Page(render_report(replace(made_context(), damaged={result: f"{result}.json"})))
    assert page.text.count(f"results/{result}.json is damaged or cut short") == 2  # on the first screen, and below
    assert untrue not in page.text


LACKING = (
    Flag("speed_missed", message="it swims at 142 mm/s, its twin at 133"),
    Flag("scale_drifts", message="it does"),
)
OF_POSTERIOR = (Flag("model_discrepancy", message="something is missing"), Flag("emulator_off", message="it is off"))


@pytest.mark.parametrize(
    ("change", "explains"),
    [
        ({}, True),
        ({"verdict": "inseparable"}, False),
        ({"borderline": "unexplained (background_current)"}, False),
        ({"doubted_trials": ("slow",)}, False),
        ({"models": ()}, False),
        ({"withheld_from_catalogue": ("wave_drag",)}, False),
    ],
)
def test_what_says_no_more_than_that_the_named_effects_lack_is_no_caveat(
    context: ReportContext, change: dict[str, Any], explains: bool
) -> None:
    first, *others = context.calibration.trials
    calibration = replace(context.calibration, trials=(replace(first, flags=LACKING), *others))
    found = made_diagnosed("named")
    validated = replace(
        found.evidence, cross_validation=replace(found.evidence.cross_validation, trials=("a", "b", "c"))
    )
    plain = replace(found, remainder=None, models=("twin.xml",), effect_parameters={}, evidence=validated)
    clear = replace(plain, **change)
    posterior = replace(made_summary(), flags=OF_POSTERIOR)
    answers = replace(context, calibration=calibration, diagnosed=clear, posterior=posterior).answers

    kinds = ("misses the speed", "omething is missing")
    assert [any(kind in text for text in answers.explained) for kind in kinds] == [explains] * 2
    assert [any(kind in text for text in answers.caveats) for kind in kinds] == [not explains] * 2
    assert any("It is off" in text for text in answers.caveats)
    assert not set(answers.explained) & set(answers.caveats)


@pytest.mark.parametrize(
    ("shrinkage", "after_mm", "closer"),
    [(0.8, 3.0, True), (-0.1, 3.0, False), (np.nan, 3.0, False), (0.1, 13.0, False)],
)
def test_a_model_that_forecasts_no_better_is_not_proposed(shrinkage: float, after_mm: float, closer: bool) -> None:
    found = made_diagnosed("named")
    gap = replace(found.gap, shrinkage=shrinkage, with_effects_mm=after_mm)
    step = use_of_named(replace(found, gap=gap, models=("calibrated+tendon_slack.xml",)))
    assert ("calibrated+tendon_slack.xml" in step) == closer
    assert ("forecasts as well" in step) == (not closer and not np.isnan(shrinkage))
    assert ("too little to tell" in step) == np.isnan(shrinkage)


@pytest.mark.parametrize(
    ("explains", "said"), [(True, ", which do not know of tendon slack and wave drag"), (False, "")]
)
def test_what_bands_do_not_know_of_is_told_where_it_explains_the_rest(
    context: ReportContext, monkeypatch: pytest.MonkeyPatch, explains: bool, said: str
) -> None:
    monkeypatch.setattr("reports.context.explains_the_rest", lambda _found: explains)
    assert context.unknown_to_bands == said
    assert replace(context, diagnosed=None).unknown_to_bands == ""


def test_the_chart_of_speeds_is_there_once_for_wide_and_once_for_narrow_screens(context: ReportContext) -> None:
    page = render_report(context, (build_summary,))
    assert page.count('class="plot on-wide"') == page.count('class="on-narrow"') == 1
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
