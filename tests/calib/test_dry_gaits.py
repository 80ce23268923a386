"""Dry runs and free decays as a diagnosis takes them: those that may be fitted; runs measured as swims are."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from tests.calib.door import ROOT, edit

WITH_DRY_RUN = ROOT / "datasets" / "withheld" / "small" / "sessions" / "w5dee115d"

WITH_DECAY = WITH_DRY_RUN.with_name("w1efa52ce")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(WITH_DRY_RUN, tmp_path / "pool", ignore=shutil.ignore_patterns("results")))


def pipeline(folder: Path) -> Pipeline:
    return Pipeline(open_session(folder), Options("quick", workers=1))


@pytest.mark.long
def test_a_dry_run_has_a_features_whose_head_stands_still(folder: Path) -> None:
    (run,) = pipeline(folder).recordings.in_air.runs
    assert run.name.startswith("dry")
    assert run.commanded_hz is not None
    assert run.frequency.hz == pytest.approx(run.commanded_hz, rel=0.01)
    nose = run.position_m[:, run.markers.index("nose")]
    fin = run.position_m[:, run.markers.index("caudal_fin")]
    assert np.nanstd(nose, axis=0).max() < 0.1 * np.nanstd(fin, axis=0).max()
    assert abs(run.speed) < 1e-3


@pytest.mark.long
def test_one_that_is_held_out_is_no_evidence(folder: Path) -> None:
    edit(folder / "session.toml", 'commanded_hz = 0.73\nrole = "fit"', 'commanded_hz = 0.73\nrole = "holdout"')
    assert pipeline(folder).recordings.in_air.runs == []


@pytest.mark.long
def test_a_free_decay_is_evidence_but_not_one_that_is_held_out(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(WITH_DECAY, tmp_path / "pool", ignore=shutil.ignore_patterns("results")))
    assert [decay.name for decay in pipeline(folder).recordings.in_air.decays] == ["decay"]
    reported = 'tracks = "trials/decay.csv.gz"\nrole = '
    edit(folder / "session.toml", f'{reported}"fit"', f'{reported}"holdout"')
    assert not pipeline(folder).recordings.in_air.decays
