"""The tables of the posterior's benchmark tell a posterior that is right from one that is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.posterior.report import PosteriorOutcome, holm, uniform_p
from benchmarks.posterior.store import Failure
from session import plain_json
from tests.benchmarks.posterior.scores import score
from tests.cases import later


def test_a_posterior_that_is_right_passes() -> None:
    for found in PosteriorOutcome("none", tuple(map(score, range(400)))).calibrations:
        assert found.covered_low < 0.9 < found.covered_high
        assert min(found.chi2_p, found.ks_p) > 0.05
        assert found.spread == pytest.approx(1.0, abs=0.1)
        assert sum(found.ranks) == 400


@pytest.mark.parametrize(("narrow", "shift"), [(0.6, 0.0), *later((1.0, 0.7))])
def test_one_that_is_too_narrow_or_shifted_does_not(narrow: float, shift: float) -> None:
    for found in PosteriorOutcome("none", tuple(score(seed, narrow, shift) for seed in range(400))).calibrations:
        assert found.covered_high < 0.9
        assert max(found.chi2_p, found.ks_p) < 0.01


def test_widths_stand_beside_the_exact_ones_where_these_are_known() -> None:
    found = PosteriorOutcome("none", tuple(score(seed, 1.2) for seed in range(60))).calibrations
    assert found[0].width == pytest.approx(1.2, rel=0.02)
    assert np.isnan(found[4].width)


def test_what_is_asked_is_judged() -> None:
    right = PosteriorOutcome("none", tuple(map(score, range(400))))
    narrow = PosteriorOutcome("none", tuple(score(seed, narrow=0.6) for seed in range(400)))
    assert [len(missed) for missed in right.misses.values()] == [0, 0, 0]
    assert [len(missed) for missed in narrow.misses.values()][:2] == [5, 5]
    assert "90 % intervals hold 86 to 94 % of truths: yes" in right.text()
    assert "of truths: missed by blunt_drag, slender_drag" in narrow.text()


def test_warnings_are_counted_by_kind() -> None:
    lines = PosteriorOutcome("none", tuple(score(seed, warns=seed < 5) for seed in range(20))).text()
    assert "of that, by kind: model_discrepancy 25.0%" in lines


def test_a_miss_with_a_warning_is_not_silent() -> None:
    silent, warned = ([score(seed, 0.05, warns=warns) for seed in range(20)] for warns in (False, True))
    assert PosteriorOutcome("none", tuple(silent)).far_silent > 0.9
    told = PosteriorOutcome("none", tuple(warned))
    assert (told.silent, told.far_silent, told.warned) == (0.0, 0.0, 1.0)


def test_few_sessions_are_not_tested_for_uniformity() -> None:
    assert np.isnan(uniform_p(np.arange(20), np.linspace(0, 1, 20))).all()
    few = PosteriorOutcome("none", tuple(map(score, range(20))))
    assert few.misses == {}
    assert "of truths: yes" not in few.text()


def test_p_values_are_corrected_for_their_number() -> None:
    assert holm(np.array([[0.01, 0.04], [0.03, 0.005]])) == pytest.approx(np.array([[0.03, 0.06], [0.06, 0.02]]))


def test_failures_and_files_of_other_code_are_told() -> None:
    outcome = PosteriorOutcome("none", (score(0),), (Failure(7, "NotEnoughData: too short"),), 3)
    assert "session 7 failed: NotEnoughData: too short" in outcome.text()
    assert "3 files in the folder are of other code" in outcome.text()
    assert plain_json(outcome.to_json())["failures"] == [{"seed": 7, "message": "NotEnoughData: too short"}]
    assert "no session yet" in PosteriorOutcome("none", ()).text()


def test_seeds_without_a_score_are_told() -> None:
    outcome = PosteriorOutcome("none", (score(0),), gaps=(3, 8))
    assert "no score of seeds 3, 8" in outcome.text()
    assert outcome.to_json()["seeds_without_a_score"] == [3, 8]


def test_each_effect_of_a_mixed_set_has_a_line_with_what_was_missed_in_silence() -> None:
    still = replace(score(1), effect="current")
    far = replace(score(2, narrow=0.05), effect="entrained_water")
    lines = PosteriorOutcome("any", (still, far)).text().splitlines()
    assert next(line for line in lines if line.startswith("entrained_water")).split()[1:] == [
        "1",
        "1",
        "0",
        "1",
        "1",
        "1",
        "1",
    ]
    assert next(line for line in lines if line.startswith("current")).split()[2:4] == ["1", "0"]
