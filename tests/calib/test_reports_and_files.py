"""`calib report` of several sessions, `calib mjcf`, and results made with another engine."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimcal.errors import ModelMismatch
from swimcal.mjcf import PUBLISHED_COEFFICIENTS
from tests.calib.door import Front, files_in


def test_the_nominal_mjcf_is_that_of_the_published_fish(calib: Front, tmp_path: Path) -> None:
    outcome = calib("mjcf", "--out", tmp_path / "fish.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "fish.xml"))

    assert (outcome.code, outcome.out.splitlines()[-1]) == (0, str(tmp_path / "fish.xml"))
    for name in ("surge", "sway", "yaw", "crank", "tail_1", "tail_5"):
        assert model.joint(name).id >= 0
    fluid = model.geom_fluid[model.geom_fluid[:, 0] > 0, 1:6]
    np.testing.assert_allclose(fluid, np.tile(PUBLISHED_COEFFICIENTS, (len(fluid), 1)), rtol=1e-5)


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [("mujoco", "3.12.0", "MuJoCo: made with 3.12.0, here"), ("model_sha256", "0" * 64, "model")],
)
def test_a_calibration_of_another_engine_or_model_is_refused(finished: Path, key: str, value: str, named: str) -> None:
    path = finished / "results" / "calibration.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))

    with pytest.raises(ModelMismatch) as refused:
        Pipeline(open_session(finished), Options("quick")).fits.read()
    assert str(path) in str(refused.value)
    assert named in str(refused.value)
    assert "Fit again with `calib fit`" in str(refused.value)


def test_versions_are_reported(calib: Front) -> None:
    outcome = calib("--version")

    assert outcome.code == 0
    assert mujoco.__version__ in outcome.out
    assert outcome.out.startswith("swimcal ")


@pytest.mark.long
def test_no_command_leaves_a_log_of_the_engine_behind(
    calib: Front, fresh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert "MUJOCO_LOG.TXT" not in files_in(tmp_path)
