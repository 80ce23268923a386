"""Every figure of a report has a caption that says what to see in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from fitting.free_decay import combine_decays, fit_decay, measure_decay_trial
from reports.blocks import Plot, Plots, Section
from reports.sections import SECTIONS
from tests.fitting.free_decay.decays import CAMERA, ROBOT, Truth, decay_tracks
from tests.reports.bench import made_bench_calibration
from tests.reports.diagnoses import made_diagnosed
from tests.reports.posteriors import made_findings
from tests.reports.sample import made_context, made_evidence, made_searches
from tests.reports.undrawn import nothing_drawn

WITH_FIGURES = {
    "summary",
    "free-decay",
    "dry-runs",
    "motor",
    "speed",
    "errors",
    "pairs",
    "trials",
    "residuals",
    "tail-beat",
    "coefficients",
    "posterior",
    "gap",
    "placement",
    "searches",
    "tracks",
}
FEWEST_WORDS = 8


@pytest.fixture(scope="module")
def sections() -> tuple[Section, ...]:
    """Of a session that lacks nothing; how its figures look is not asked here."""
    decay = fit_decay(measure_decay_trial("decay_1", decay_tracks(Truth()), CAMERA, ROBOT), ROBOT, workers=1)
    calibration = made_bench_calibration()
    structure = replace(calibration.structure, decays=(decay,), hinges=combine_decays([decay]))
    context = replace(
        made_context(replace(calibration, structure=structure)),
        evidence=made_evidence(),
        searches=made_searches(),
        posterior=made_findings(),
        diagnosed=made_diagnosed(),
    )
    with nothing_drawn():
        return tuple(section for build in SECTIONS if (section := build(context)) is not None)


def plots_of(section: Section) -> Iterator[Plot]:
    for block in section.blocks:
        if isinstance(block, Plots):
            yield from block.plots
    for part in section.parts:
        yield from plots_of(part)


def test_every_figure_says_in_sentences_what_to_see_in_it(sections: tuple[Section, ...]) -> None:
    plots = [plot for section in sections for plot in plots_of(section)]
    bare = [plot.name for plot in plots if len(plot.caption.split()) < FEWEST_WORDS or plot.caption.strip()[-1] != "."]

    assert bare == []
    assert len({plot.name for plot in plots}) == len(plots)


def test_these_sections_have_figures(sections: tuple[Section, ...]) -> None:
    assert {section.anchor for section in sections if next(plots_of(section), None)} == WITH_FIGURES
