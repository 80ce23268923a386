"""A withheld session is one like any user's, and its answer is true."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.effects.filming import film_together
from benchmarks.effects.folder import Answer
from benchmarks.effects.making import GENERATORS, Making
from benchmarks.effects.suite import Recorded, SessionPlan
from diagnosis.discrepancy import Discrepancy
from swimcal.effects.catalogue import catalogue

RECORDED = Recorded((0.6, 1.0), (0.8, 1.2), 4.0, 0.7, True, True)
NULL = SessionPlan("w00000001", 11, RECORDED, "null")
SINGLE = SessionPlan("w00000002", 12, RECORDED, "single", ("bend_offset",), 10.0)
TRIED = ("bend_offset", "tendon_asymmetry", "head_frame_misalignment", "stiffness_error")
DISCREPANCY = Discrepancy.independent((2e-4) ** 2 * np.eye(127))


@pytest.fixture(scope="module")
def making() -> Making:
    effects = {name: catalogue()[name] for name in TRIED}
    return Making(GENERATORS["reality"], DISCREPANCY, effects)


@pytest.fixture(scope="module")
def suite(making: Making, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Answer]]:
    folder = tmp_path_factory.mktemp("suite")
    null, single = film_together([making.make(NULL, folder), making.make(SINGLE, folder)])
    return folder, {NULL.name: null, SINGLE.name: single}


@pytest.mark.long
def test_the_answer_says_what_is_there(suite: tuple[Path, dict[str, Answer]]) -> None:
    _, answers = suite
    assert answers[NULL.name] == Answer(NULL.name, "null", seed=NULL.seed)
    single = answers[SINGLE.name]
    assert single.effects == ("bend_offset",)
    assert single.stage == "tail"
    assert single.detectability == pytest.approx(10.0, rel=0.1)
    assert single.alike == ((),)
    assert single.oracle_shrinkage is not None
    assert 0.7 < single.oracle_shrinkage < 1.0


@pytest.mark.long
def test_an_effect_changes_the_tracks_and_nothing_else_does(making: Making, tmp_path: Path) -> None:
    """The same plan with nothing in it: robot, water, boxes and noise are the same."""
    without = replace(SINGLE, kind="null", effects=(), detectability=0.0)
    film_together([making.make(SINGLE, tmp_path / "with"), making.make(without, tmp_path / "without")])
    packed = [tmp_path / each / SINGLE.name / "trials" / "f0_60.csv.gz" for each in ("with", "without")]
    plain = [gzip.decompress(each.read_bytes()).decode().splitlines() for each in packed]
    tracks = [np.genfromtxt(each, delimiter=",", names=True) for each in plain]
    off = tracks[0]["caudal_fin_y"] - tracks[1]["caudal_fin_y"]
    assert 0.5 < np.abs(off).max() < 60
    assert np.abs(tracks[0]["time_s"] - tracks[1]["time_s"]).max() == 0
