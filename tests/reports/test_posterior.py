"""The section on how sure the coefficients are says what its posterior says, and says so when there is none."""

import re
from dataclasses import replace

import pytest

from fitting.posterior.summary import PosteriorSummary
from fitting.posterior.whiteness import noise_flags
from reports import posterior
from reports.first_screen import build_summary
from reports.report import render_report
from tests.reports.page import Page, nothing_drawn
from tests.reports.posteriors import made_summary
from tests.reports.sample import made_context


def page_of(found: PosteriorSummary | None) -> Page:
    return Page(render_report(replace(made_context(), posterior=found), (build_summary, posterior.build_posterior)))


@pytest.fixture(scope="module")
def page() -> Page:
    with nothing_drawn():
        return page_of(made_summary())


def test_without_a_posterior_it_tells_how_to_sample_one() -> None:
    bare = page_of(None)

    assert "The posterior of the coefficients was not sampled for this session; calib posterior SESSION" in bare.text
    assert "posterior-corner" not in bare.ids


@pytest.mark.parametrize(
    "said",
    [
        "Magnus lift is not determined by these trials; blunt drag, angular drag",
        "Markers sit some 7 mm from where the robot's description has them",
        "hinge stiffness 1.2 dry experiments 0 ± 1",
        "crank arm 2 assumed: not measured −2.1 ± 0.8",
        "0 of 1 held-out trial swam at a speed within its 90 % band (87.5 % of their marker coordinates",
        "2 of 2 fit trials swam",
        "slow held out 55.0",
        "One more swim of 5 s at 0.5 Hz would narrow what is not determined most",
        "deviation of slender drag to 50 % and Magnus lift to 50 % of what it is. Next best: 1.4 Hz",
        "16 walkers, 4000 steps each: at least 500",
        "medium 150 21 0.10 10 0.80 0.50 0.04 (chance 0.20) yes",
    ],
)
def test_numbers_of_the_posterior_stand_with_what_they_are_of(page: Page, said: str) -> None:
    assert said in page.text


def test_every_interval_stands_beside_the_fit(page: Page) -> None:
    assert re.search(r"Magnus lift [\d.]+ 3 ± 2 [\d.]+ to [\d.]+ 69 no", page.text)
    assert re.search(r"slender drag [^–]* at a bound angular drag", page.text)
    assert not re.search(r"\bnan\b", page.text)


@pytest.mark.usefixtures("words_alone")
def test_noise_that_neighbours_still_share_is_said() -> None:
    found = made_summary()
    alike = tuple(replace(white, neighbours=0.4 + 0 * white.neighbours) for white in found.whiteness)
    text = page_of(replace(found, whiteness=alike, flags=tuple(noise_flags(alike)))).text

    assert "medium 150 21 0.10 10 0.80 0.50 0.40 (chance 0.20) no" in text
    assert (
        "medium: what the noise model leaves of the tracks is not white: neighbouring markers correlate by 0.40" in text
    )
