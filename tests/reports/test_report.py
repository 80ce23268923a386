"""The report as a file: complete, self-contained, and honest about what is missing."""

import re
from dataclasses import replace

import pytest

from reports.context import ReportContext
from reports.report import render_report
from swimcal.flags import Flag
from tests.reports.page import Page
from tests.reports.sample import made_calibration, made_context, made_session


@pytest.fixture(scope="module")
def page() -> Page:
    return Page(render_report(replace(made_context(), notes=("free decay was left out",))))


@pytest.fixture(scope="module")
def medium() -> ReportContext:
    """Of a single trial."""
    return made_context(made_calibration(("medium",)))


@pytest.fixture(scope="module")
def html_of_medium(medium: ReportContext) -> str:
    return render_report(medium)


def test_every_section_is_there_and_every_link_leads_to_one(page: Page) -> None:
    sections = ["summary", "caveats", "forecasts", "trials", "residuals", "tail-beat", "posterior", "coefficients"]
    sections += ["gap", "robot-sketch", "structure", "tracks", "provenance", "reading"]
    links = [target[1:] for target in page.targets if target.startswith("#")]

    assert [name for name in page.ids if name in sections] == sections
    assert set(links) <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert page.open == []


def test_nothing_is_asked_for_from_outside(page: Page, html_of_medium: str) -> None:
    html = html_of_medium

    assert all(target.startswith(("#", "data:,")) for target in page.targets), page.targets
    assert "@import" not in html
    assert "url(http" not in html
    assert "<img" not in html
    assert "default-src 'none'" in html
    assert len(html.encode()) < 1e6


def test_flags_stand_in_the_summary_and_with_their_trial(page: Page) -> None:
    summary, rest = page.text.split("Speeds and markers", 1)[0], page.text

    assert "magnus_lift = 0 is at its bound 0: the data favour a value beyond it." in summary
    assert "outside the range of the trials that were fitted" in summary
    assert "slow: the swim frequency differs from the command" in summary.replace("Slow", "slow")
    assert "The tail beats at 0.500 Hz, -25 % off the commanded 0.67 Hz." in rest
    assert "The speeds are slopes over one beat." in rest
    assert "No lens calibration is given" in rest
    assert "No free decay: hinge stiffness 0.65 N m/rad as in the built-in robot." in rest


@pytest.mark.parametrize(
    "said",
    [
        "merged markers 100 to 139 3.33 to 4.63 tail_3 sits on tail_1: 2 px apart",
        "Free decay was left out.",
        "session.toml " + "a" * 64,
        "c" * 64,
        "MuJoCo 4.0.0",
        "swimcal 0.1.0",
        "seed 7",
    ],
)
def test_flags_notes_and_provenance_are_printed(page: Page, said: str) -> None:
    assert said in page.text


@pytest.mark.usefixtures("words_alone")
def test_without_held_out_trials_it_says_that_nothing_was_predicted() -> None:
    page = Page(render_report(made_context(made_calibration(("medium", "fast")))))

    assert "No held-out trial tells how well it forecasts." in page.text
    assert "forecast-speeds" not in page.ids
    assert "No trial was held out: every error below is one of the fit." in page.text
    assert not re.search(r"\bnan\b", page.text)


@pytest.mark.usefixtures("words_alone")
def test_names_and_messages_are_escaped() -> None:
    hostile = "<script>alert('x')</script> & $co_"
    calibration = made_calibration(("medium",))
    flags = (Flag("odd_kind", message=hostile),)
    calibration = replace(calibration, fit=replace(calibration.fit, flags=flags))
    context = replace(made_context(calibration), session=made_session(name=hostile), notes=(hostile,))
    html = render_report(context)

    assert "<script>alert" not in html
    assert Page(html).text.count("<script>alert('x')</script> & $co_") >= 4


@pytest.mark.long
def test_the_same_results_give_the_same_file(medium: ReportContext, html_of_medium: str) -> None:
    assert render_report(medium) == html_of_medium
