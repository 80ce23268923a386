"""The section on the sim-to-real gap says what its diagnosis says, for every verdict, and how to get one."""

import re
from dataclasses import replace

import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from diagnosis.constants import HELD
from diagnosis.result import DiagnosisResult
from reports import render_report
from reports.colours import EBT_SMOOTHED, WARN
from reports.figures import gap_which
from reports.figures.gap_how_far import gap_waterfall_figure
from reports.page import render_page
from reports.sections import gap
from session.records import to_plain
from swimmer import load_robot
from tests.reports.diagnoses import made_diagnosed, made_everything, made_forces
from tests.reports.page import Page
from tests.reports.sample import made_context
from tests.reports.undrawn import nothing_drawn

ROBOT = load_robot()
VERDICTS = ("named", "inseparable", "unexplained", "no_gap")


def page_of(found: DiagnosisResult | None, effort: str = "full") -> Page:
    """A report of this section alone."""
    section = gap.build(replace(made_context(), diagnosed=found, diagnosis_effort=effort))
    return Page(render_page("report.html.j2", title="pool", session="pool", byline="", questions=[("", [section])]))


@pytest.fixture(scope="module")
def pages() -> dict[str, Page]:
    with nothing_drawn():
        return {verdict: page_of(made_diagnosed(verdict)) for verdict in VERDICTS}


@pytest.fixture(scope="module")
def page() -> Page:
    """Of a named gap, its figures drawn."""
    return page_of(made_diagnosed("named"))


def test_without_a_diagnosis_it_tells_how_to_get_one() -> None:
    bare = page_of(None)

    assert "This session was not diagnosed. Run calib diagnose SESSION" in bare.text
    assert "gap-fish" not in bare.ids


@pytest.mark.usefixtures("words_alone")
@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        ("named", "The diagnosis names tendon slack and wave drag, which this fit leaves out"),
        ("inseparable", "The diagnosis names tendon slack or tendon friction, which this fit leaves out"),
        ("unexplained", "The diagnosis finds a gap that no effect of its catalogue explains"),
        ("no_gap", ""),
    ],
)
def test_the_summary_says_what_a_fit_leaves_out(verdict: str, said: str) -> None:
    whole = Page(render_report(replace(made_context(), diagnosed=made_diagnosed(verdict))))
    assert said in whole.text.split("Speed Forward", 1)[0]
    assert ("The diagnosis" in whole.text.split("Speed Forward", 1)[0]) == bool(said)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_three_sentences_answer_the_three_questions(pages: dict[str, Page], verdict: str) -> None:
    asked = [pages[verdict].text.index(question) for question in ("Where?", "Which?", "How far?")]

    assert asked == sorted(asked)
    assert not re.search(r"\bnan\b|None", pages[verdict].text)
    assert pages[verdict].open == []


def test_every_figure_of_a_named_gap_is_in_the_page(page: Page) -> None:
    wanted = {"fish", "shares", "effects", "waterfall", "held-out", "forces"}

    assert {name.removeprefix("gap-") for name in page.ids} >= wanted
    assert len(page.ids) == len(set(page.ids))


def test_shares_stand_at_their_parts_negative_ones_too(page: Page) -> None:
    assert "−2 % camera" in page.text
    assert "60 % tail" in page.text
    assert "caudal fin 60 %" in page.text
    assert "60 to 75 %" in page.text


def test_effects_that_act_together_are_reported_with_what_they_leave(page: Page) -> None:
    assert "Together tendon slack wave drag" in page.text
    assert "With tendon slack and wave drag, 12 % of the gap in the fitted trials remains" in page.text
    assert "(p < 0.001): another effect is present." in page.text


@pytest.mark.usefixtures("words_alone")
def test_a_remainder_that_noise_would_leave_passes_for_noise() -> None:
    rest = {"share": 0.0, "stage": "tail", "p_value": 0.4}

    assert "is no more than noise (p = 0.40)" in page_of(made_diagnosed(remainder=rest)).text


def test_alternatives_are_reported_as_such_and_what_would_separate_them(pages: dict[str, Page]) -> None:
    text = pages["inseparable"].text

    assert "Verdict: inseparable." in text
    assert "One of these tendon slack or tendon friction" in text
    assert "Run it dry. tendon slack and tendon friction 4" in text


def test_a_gap_that_shrinks_by_more_than_all_of_it_says_why() -> None:
    more = {"shrinkage": 1.2, "shrinkage_ci95": [0.9, 1.2]}
    page = page_of(made_diagnosed(gap=more))
    assert "the held-out gap shrinks by 120 %" in page.text
    assert "Above 100 %: the residual is smaller than the assumed noise." in page.text


def test_shrinkage_comes_with_its_interval_and_what_it_is_over(page: Page) -> None:
    assert "the held-out gap shrinks by 80 % (95 % interval 70 % to 90 %)." in page.text
    assert "The interval covers trials, noise and fitted parameters." in page.text
    assert "Above 100 %" not in page.text
    assert (
        "For comparison: 5 % with motor speed sag instead, an effect that the evidence rejects; 30 % with the residual"
        in page.text
    )
    assert "12.0 → 3.0" in page.text
    assert "11.0 → 2.0" in page.text


@pytest.mark.usefixtures("words_alone")
def test_a_gap_that_grows_is_said_and_drawn_as_such() -> None:
    shrunk = {"shrinkage": -0.5, "shrinkage_ci95": [-0.6, -0.4], "squares_after": 7.0}
    found = made_diagnosed(gap=shrunk)

    assert "What explains the fit trials does not help the held-out ones." in page_of(found).text
    assert colours_of(gap_waterfall_figure(found)) >= {WARN}
    assert EBT_SMOOTHED not in colours_of(gap_waterfall_figure(found))


@pytest.mark.usefixtures("words_alone")
def test_without_a_held_out_gap_nothing_shrinks() -> None:
    shrunk = {"shrinkage": None, "shrinkage_ci95": None, "squares_before": 1.0}

    assert "The residual of the held-out trials is no more than noise" in page_of(made_diagnosed(gap=shrunk)).text


@pytest.mark.usefixtures("words_alone")
def test_all_effects_at_once_are_reported_where_they_are_called_for() -> None:
    page = page_of(made_diagnosed("unexplained", everything=made_everything()))

    assert "the fitted trials support more than is named, by a log Bayes factor of 41" in page.text
    assert (
        "With it the held-out gap shrinks by 30 % (95 % interval over the noise of these trials 10 % to 60 %)"
        in page.text
    )
    assert "At a bound: crank arm error (relative)." in page.text
    assert "camera and markers 0.20 (0.10 to 0.30) and tendons 0.10 (−0.05 to 0.20)" in page.text
    assert "camera and markers 0.0 (−1.0 to 1.0) and tendons +4.0 (2.0 to 6.0)" in page.text
    assert (
        "The fewest groups that forecast as well within one standard error over trials: camera and markers."
        in page.text
    )
    assert "Of the speed error alone tendons would do as well." in page.text
    worse = made_everything()["gap"] | {"shrinkage": -0.2, "shrinkage_ci95": [-0.3, 0.1]}
    grown = page_of(made_diagnosed("unexplained", everything=made_everything() | {"gap": worse}))
    assert (
        "With it the held-out gap grows by 20 % (95 % interval over the noise of these trials −10 % to 30 %)"
        in grown.text
    )
    assert "crank arm error (relative −3.2) and tendon asymmetry (length 1.4)" in page.text
    assert "gap-everything" in page.ids
    assert "gap-everything" not in page_of(made_diagnosed("unexplained")).ids


@pytest.mark.usefixtures("words_alone")
def test_without_held_out_swims_it_says_how_to_hold_one_out() -> None:
    bare = page_of(made_diagnosed(held_out=False))

    assert 'the role "holdout" in session.toml' in bare.text
    assert "gap-waterfall" not in bare.ids
    assert "gap-effects" in bare.ids


@pytest.mark.parametrize(
    ("verdict", "says"), [("unexplained", "Verdict: unexplained."), ("no_gap", "Verdict: no gap.")]
)
def test_where_nothing_is_named_nothing_was_added(pages: dict[str, Page], verdict: str, says: str) -> None:
    text = pages[verdict].text

    assert says in text
    assert "Nothing was added to the twin; this is its gap." in text
    assert "as strong as the refit" not in text
    assert "12.0 →" not in text


@pytest.mark.usefixtures("words_alone")
def test_a_near_miss_is_called_that(pages: dict[str, Page]) -> None:
    near = page_of(made_diagnosed("no_gap", no_gap_probability=0.06))

    assert "the probability of some effect is 0.94, and the first suspect is tendon slack (0.93)." in near.text
    assert "near miss" not in pages["no_gap"].text


def test_an_unexplained_gap_is_led_by_what_is_missing(pages: dict[str, Page]) -> None:
    assert "The most significant is the torque in tail 5: 2.83 mN m" in pages["unexplained"].text
    assert "It is a lead to the effect that the catalogue lacks." in pages["unexplained"].text


@pytest.mark.usefixtures("words_alone")
def test_forces_that_noise_could_feign_are_called_that() -> None:
    found = made_diagnosed(missing_forces=to_plain(made_forces(sd=0.004)))

    assert "No missing force differs significantly from zero over half of the beat." in page_of(found).text


def test_parameters_have_intervals_units_and_their_physics(page: Page) -> None:
    assert "tendon slack length 0.0021 0.0018 to 0.0024 m" in page.text
    assert "wave drag high −1.5 −2 to −1, at its bound s" in page.text
    assert "tendon slack: " in page.text


def test_explanations_are_listed_with_their_weight(page: Page) -> None:
    assert (
        "tendon slack + wave drag 0.700 wave drag + another effect that looks like tendon slack 0.100 "
        "another effect 0.020 no effect 0.001"
    ) in page.text


def test_places_of_something_else_and_what_shows_beside_the_beat_are_in_one_table(page: Page) -> None:
    assert (
        "marker tail 4 the same 0.070 hinge tail 1 the same 0.060 "
        "phase jitter (4.00 ms) different 0.050 "
        "whole fish, non-periodic (0.40 mm) different 0.030"
    ) in page.text


def test_effort_and_a_shorter_catalogue_are_caveats() -> None:
    found = made_diagnosed(withheld_from_catalogue=["scale_error"])

    assert "made with effort quick. Its catalogue lacked scale error." in page_of(found, "quick").text


def test_names_are_said_from_where_the_verdict_says_them() -> None:
    assert gap_which.HELD == HELD == 0.5, "as the caption says"


def colours_of(figure: Figure) -> set[str]:
    return {to_hex(patch.get_facecolor()) for patch in figure.axes[0].patches}


def rgb(colour: str) -> tuple[float, ...]:
    return to_rgb(colour)
