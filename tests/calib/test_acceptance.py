"""The whole way with the search that users get: the shipped sample, and the public tracks of the real robot."""

from __future__ import annotations

import json
import shutil
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from calib.pipeline import Options, Pipeline, open_session
from session import new_from_fishsim, read_result_json
from tests.calib.door import ROOT, Front
from tests.calib.test_run import SCHEMA
from tests.session.sample import FISHSIM, needs_fishsim

CORE_S = 2 * 30.0
"""What the fit of the public tracks may take: 30 s on two cores."""
SLACK = 2.0
"""Times that, before a slow machine fails a test."""


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], float]:
    """`calibration.json` of the public tracks with full effort, and the time all cores spent on it, s."""
    folder = new_from_fishsim(tmp_path_factory.mktemp("real") / "fishsim", FISHSIM, ("f1_00", "f1_75"))
    began = time.process_time()
    data = read_result_json(Pipeline(open_session(folder), Options("full")).fit())
    return data, time.process_time() - began


@pytest.mark.long
@needs_fishsim
@pytest.mark.usefixtures("true_effort")
class TestRealRobot:
    """f1_00 and f1_75 are fitted, the three others held out."""

    def test_markers_are_met_better_than_by_the_authors_code(self, real: tuple[dict[str, Any], float]) -> None:
        summary = real[0]["summary"]

        assert summary["fit"]["marker_error_mm"] <= 39.0
        assert all(0.9 < trial["used_fraction"] <= 1 for trial in real[0]["trials"].values())

    def test_held_out_speeds_are_foretold_better_than_by_ebt(self, real: tuple[dict[str, Any], float]) -> None:
        held_out = real[0]["summary"]["holdout"]

        assert held_out["speed_mae_twin"] <= 0.024
        assert held_out["speed_mae_twin"] < held_out["speed_mae_ebt"]

    def test_the_slow_trials_are_called_extrapolated(self, real: tuple[dict[str, Any], float]) -> None:
        flagged = {
            name for name, trial in real[0]["trials"].items() if "extrapolated" in [f["kind"] for f in trial["flags"]]
        }
        assert flagged == {"f0_50", "f0_75"}

    def test_what_cannot_be_trusted_says_so(self, real: tuple[dict[str, Any], float]) -> None:
        low, high = 0.01, 9.99
        at_bound = [name for name, value in real[0]["coefficients"].items() if not low < value < high]
        told = [flag["message"] for flag in real[0]["flags"] if flag["kind"] == "at_bound"]

        assert all(any(message.startswith(name) for message in told) for name in at_bound)

    def test_it_is_done_in_half_a_minute(self, real: tuple[dict[str, Any], float]) -> None:
        assert real[1] < SLACK * CORE_S

    @pytest.mark.skipif(not SCHEMA.is_file(), reason="the public schema is not here (../shared/design/schema)")
    def test_its_file_has_the_public_form(self, real: tuple[dict[str, Any], float]) -> None:
        jsonschema = pytest.importorskip("jsonschema")

        jsonschema.validate(real[0], json.loads(SCHEMA.read_text()))


@pytest.mark.long
@pytest.mark.usefixtures("true_effort")
def test_the_shipped_sample_is_calibrated_to_its_truth(calib: Front, tmp_path: Path) -> None:
    """What `make demo` does."""
    leave = shutil.ignore_patterns("results", ".*")
    folder = Path(shutil.copytree(ROOT / "datasets" / "sample", tmp_path / "sample", ignore=leave))
    outcome = calib("run", "--effort", "quick", folder)

    assert outcome.code == 0, outcome.err
    assert outcome.out.splitlines()[-1] == str(folder / "results" / "report.html")
    data = json.loads((folder / "results" / "calibration.json").read_text())
    truth = json.loads((folder / "truth.json").read_text())
    for name, trial in data["trials"].items():
        true = truth["trials"][name]
        assert trial["frequency_hz"] == pytest.approx(true["frequency_hz"], rel=0.01)
        assert trial["speed_twin"] == pytest.approx(true["speed_m_s"], abs=0.006)
        assert abs(np.angle(np.exp(1j * (trial["phase_rad"] - true["phase_rad"])))) < 0.1
    assert data["summary"]["holdout"]["marker_error_mm"] < 10
    assert data["summary"]["holdout"]["speed_mae_twin"] < data["summary"]["holdout"]["speed_mae_ebt"]
    assert "merged_markers" in [flag["kind"] for flag in data["trials"]["f1_30"]["flags"]]
    model = mujoco.MjModel.from_xml_path(str(folder / "results" / "calibrated.xml"))
    assert [model.key(i).name for i in range(model.nkey)] == ["f0_60", "f1_30"]
