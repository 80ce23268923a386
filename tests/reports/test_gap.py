"""The section on the sim-to-real gap says what its diagnosis says, for every verdict, and how to get one."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.result import DiagnosisResult, MissingForces
from fitting.calibration import CalibratedTrial
from fitting.pool import waves
from reports import gap
from reports.caveats import gap_caveats
from reports.first_screen import build_summary
from reports.gap_figures import likenesses, motions, seen
from reports.page import render_page
from reports.report import render_report
from swimcal.results import to_plain
from swimcal.robot import load_robot
from tests.fitting.swims import filmed
from tests.reports.diagnoses import FITTED, JOINTS, made_diagnosed, made_everything, made_forces
from tests.reports.page import Page, nothing_drawn
from tests.reports.sample import made_context, made_trial

VERDICTS = ("named", "inseparable", "unexplained", "no_gap")


def page_of(found: DiagnosisResult | None, effort: str = "full") -> Page:
    """A report of this section alone."""
    section = gap.build_gap(replace(made_context(), diagnosed=found, diagnosis_effort=effort))
    section = replace(section, caveats=(*section.caveats, *gap_caveats(found)))  # which stand on the first screen
    return Page(render_page("report.html.j2", title="pool", session="pool", byline="", questions=[("", [section])]))


@pytest.fixture(scope="module")
def pages() -> dict[str, Page]:
    with nothing_drawn():
        others = {verdict: page_of(made_diagnosed(verdict)) for verdict in VERDICTS[1:]}
    return {"named": page_of(made_diagnosed("named")), **others}


def test_without_a_diagnosis_it_tells_how_to_get_one() -> None:
    bare = page_of(None)

    assert "This session was not diagnosed. Run calib diagnose SESSION" in bare.text
    assert "gap-fish" not in bare.ids


@pytest.mark.usefixtures("words_alone")
@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        ("named", "Missing from it, at least: tendon slack and wave drag ."),
        ("inseparable", "Missing from it, at least: tendon slack or tendon friction ."),
        ("unexplained", "Something is missing from it that these trials do not name."),
        ("no_gap", "These trials do not show that an effect is missing from it."),
    ],
)
def test_the_first_sentence_says_what_the_exported_twin_lacks(verdict: str, said: str) -> None:
    whole = Page(render_report(replace(made_context(), diagnosed=made_diagnosed(verdict)), (build_summary,)))
    assert said in whole.text.replace(" and  ", " and ").replace("  ", " ")


@pytest.mark.parametrize("verdict", VERDICTS)
def test_three_sentences_answer_the_three_questions(pages: dict[str, Page], verdict: str) -> None:
    asked = [pages[verdict].text.index(question) for question in ("Where?", "Which?", "How far?")]

    assert asked == sorted(asked)
    assert not re.search(r"\bnan\b|None", pages[verdict].text)
    assert pages[verdict].open == []


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        ("named", "−2 % camera"),
        ("named", "caudal fin 60 %"),
        ("named", "60 to 75 %"),
        ("named", "Together tendon slack wave drag"),
        ("named", "12 % of the gap in the fitted trials remains"),
        ("named", "the held-out gap shrinks by 80 % (95 % interval 70 % to 90 %)."),
        ("named", "(p < 0.001): something else is missing too."),
        ("named", "12.0 → 3.0"),
        ("named", "11.0 → 2.0"),
        ("named", "tendon slack length 2.10 1.80 to 2.40 mm"),
        ("named", "wave drag high −1.50 −2.00 to −1.00, at its bound s"),
        (
            "named",
            "tendon slack + wave drag 0.700 wave drag + another effect 0.100 another effect 0.020",
        ),
        ("named", "marker tail 4 the same 0.070 hinge tail 1 the same 0.060"),
        ("inseparable", "One of these tendon slack or tendon friction"),
        ("inseparable", "Run it dry. tendon slack and tendon friction 4"),
        ("unexplained", "The most significant is the torque in tail 5: 2.83 mN m"),
    ],
)
def test_numbers_of_the_diagnosis_stand_with_what_they_are_of(pages: dict[str, Page], verdict: str, said: str) -> None:
    assert said in pages[verdict].text


@pytest.mark.usefixtures("words_alone")
@pytest.mark.parametrize(
    ("verdict", "changes", "said"),
    [
        ("named", {"remainder": {"share": 0.0, "stage": "tail", "p_value": 0.4}}, "is no more than noise (p = 0.40)"),
        ("named", {"gap": {"shrinkage": 1.2, "shrinkage_ci95": [0.9, 1.2]}}, "Above 100 %: the residual is smaller"),
        (
            "named",
            {"gap": {"shrinkage": None, "squares_before": 1.0}},
            "held-out trials leave no more than noise and the twin's own error",
        ),
        ("named", {"missing_forces": to_plain(made_forces(sd=0.004))}, "No missing force differs significantly"),
        ("named", {"withheld_from_catalogue": ["scale_error"]}, "made without scale error; run it again"),
        (
            "no_gap",
            {"no_gap_probability": 0.06},
            "some effect has a probability of 0.94, and an alarm needs 0.98; the likeliest is tendon slack (0.93).",
        ),
    ],
)
def test_what_takes_from_a_diagnosis_is_said(
    pages: dict[str, Page], verdict: str, changes: dict[str, Any], said: str
) -> None:
    text = page_of(made_diagnosed(verdict, **changes), "quick").text
    assert said in text
    assert "made with effort quick" in text
    assert said not in pages[verdict].text


@pytest.mark.long
@pytest.mark.usefixtures("words_alone")
def test_all_effects_at_once_are_reported_where_they_are_called_for(pages: dict[str, Page]) -> None:
    page = page_of(made_diagnosed("unexplained", everything=made_everything()))

    assert "the fitted trials support more than is named, by a log Bayes factor of 41" in page.text
    assert (
        "With it the held-out gap shrinks by 30 % (95 % interval over the noise of these trials 10 % to 60 %)"
        in page.text
    )
    assert "At a bound: crank arm error (relative)." in page.text
    worse = made_everything()["gap"] | {"shrinkage": -0.2, "shrinkage_ci95": [-0.3, 0.1]}
    grown = page_of(made_diagnosed("unexplained", everything=made_everything() | {"gap": worse}))
    assert (
        "With it the held-out gap grows by 20 % (95 % interval over the noise of these trials −10 % to 30 %)"
        in grown.text
    )
    assert "crank arm error (relative −3.2) and tendon asymmetry (length 1.4)" in page.text
    assert "gap-everything" in page.ids
    assert "gap-everything" not in pages["unexplained"].ids


@pytest.mark.usefixtures("words_alone")
def test_without_held_out_swims_it_says_how_to_hold_one_out() -> None:
    bare = page_of(made_diagnosed(held_out=False))

    assert 'the role "holdout" in session.toml' in bare.text
    assert "gap-effects" in bare.ids


@pytest.mark.parametrize(("chance", "said"), [(0.7, True), (0.001, False)])
def test_no_gap_that_a_wobbling_head_leaves_unexplained_says_so(chance: float, said: bool) -> None:
    found = made_diagnosed("unexplained", no_gap_probability=chance)
    assert any("path_wobbles" in caveat for caveat in gap_caveats(found)) == said


ROBOT = load_robot()


def test_missing_forces_have_the_size_and_the_course_of_their_harmonics() -> None:
    forces = made_forces(0.004, 0.001)
    mean, sd = forces.over(np.array([0.0, np.pi / 2]))

    np.testing.assert_allclose(mean[0, -1], [0.004, 0.0], atol=1e-12)
    np.testing.assert_allclose(sd[0, -1], 0.001 * np.sqrt(1 + 3), atol=1e-12)
    assert forces.size[-1] == pytest.approx(0.004 / np.sqrt(2))
    assert forces.clear[0] == 0.0


@pytest.mark.parametrize(
    ("motion", "sign"), [("deflection", -1.0), ("speed", -1.0), ("acceleration", 1.0)], ids=["spring", "damper", "mass"]
)
def test_a_torque_goes_with_the_motion_that_makes_it(motion: str, sign: float) -> None:
    """In two swims of different frequency: a spring and a mass are in phase, and reported apart all the same."""
    trials = [gently(made_trial(ROBOT, name, seconds=10.0)) for name in FITTED]
    mean = np.zeros((len(FITTED), len(JOINTS), 7))
    for place, trial in enumerate(trials):
        kept = trial.measured.kept
        time_s = trial.measured.time_s[kept]
        bend = motions(trial, kept, ROBOT)[JOINTS[-1]]
        rates = {"deflection": bend, "speed": np.gradient(bend, time_s)}
        rates["acceleration"] = np.gradient(rates["speed"], time_s)
        turn = trial.phase_rad + 2 * np.pi * trial.simulated_hz * time_s
        columns = np.column_stack([np.ones(len(turn)), waves(turn, 3)])
        mean[place, -1] = sign * 0.01 * np.linalg.lstsq(columns, rates[motion], rcond=None)[0]

    like = likenesses(MissingForces(JOINTS, FITTED, mean, 0 * mean), trials, ROBOT)

    assert like[JOINTS[-1]].motions == (motion,)
    assert like[JOINTS[-1]].correlation == pytest.approx(sign, abs=0.02)
    assert like["head_moment"].correlation == 0.0, "nothing is missing there"


def test_a_bent_hinge_is_read_off_the_markers() -> None:
    """All that lies behind the third hinge is turned by 0.2 rad."""
    trial = made_trial(ROBOT, "fast")
    markers = tuple(ROBOT.markers)
    place = ROBOT.marker_positions_m(markers)
    behind = np.maximum(place[:, 0] - ROBOT.hinge_x_m[2], 0.0)
    shape = np.stack([place[:, 0] - behind * (1 - np.cos(0.2)), place[:, 1] + behind * np.sin(0.2)], axis=1)
    shapes = np.broadcast_to(shape - shape[markers.index("nose")], (len(trial.measured.time_s), *shape.shape))
    seen = replace(trial.measured.head, shape_m=shapes)
    bent = replace(
        trial,
        measured=replace(trial.measured, tracks=filmed(markers, trial.measured.time_s, shapes, seen)),
        simulated=replace(trial.simulated, shape_m=shapes),
    )

    found = motions(bent, trial.measured.kept, ROBOT)

    assert sum(found[hinge][0] for hinge in ROBOT.hinges) == pytest.approx(0.2, abs=1e-3)
    assert max(ROBOT.hinges, key=lambda hinge: found[hinge][0]) == ROBOT.hinges[2]


def gently(trial: CalibratedTrial) -> CalibratedTrial:
    """A fifth of its sway, so that three harmonics hold the beat of every hinge."""
    return replace(trial, simulated=replace(trial.simulated, shape_m=trial.simulated.shape_m * [1.0, 0.2]))


@pytest.mark.usefixtures("words_alone")
def test_forces_that_would_print_as_zero_are_left_out_with_their_table_and_figure() -> None:
    small, none = made_forces(0.004), made_forces(1e-7)
    assert [small.joints[place] for place in seen(small)] == [small.joints[-1]]
    context = made_context()
    for forces, shows in ((small, True), (none, False)):
        diagnosed = made_diagnosed("named", missing_forces=to_plain(forces))
        page = render_report(replace(context, diagnosed=diagnosed), (gap.build_gap,))
        assert ('id="gap-forces"' in page) == shows
        assert ("Size of each missing force" in page) == shows
        assert "0.00 mN" not in page


@pytest.mark.usefixtures("words_alone")
def test_a_gap_that_grows_is_said() -> None:
    shrunk = {"shrinkage": -0.5, "shrinkage_ci95": [-0.6, -0.4], "squares_after": 7.0}
    found = made_diagnosed(gap=shrunk)

    assert "What explains the fit trials does not help the held-out ones." in page_of(found).text
