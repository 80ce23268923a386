"""A whole diagnosis of swims of a robot whose crank arm is longer than described."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from diagnosis import Diagnosis, Settings, diagnose, discrepancy_for
from diagnosis.diagnosis_file import diagnosis_result
from diagnosis.refit import refit
from diagnosis.result import DIAGNOSIS
from diagnosis.sentences import sentences
from fitting import MeasuredTrial
from session import FISHSIM_MARKERS, Provenance
from swimmer import CrankTurn, Twin
from swimmer.effects import catalogue
from tests.diagnosis.grounds import ARM, CAMERA, ROBOT, ground, shorter, trials

EFFECTS = {name: catalogue()[name] for name in ("crank_arm_error", "bend_offset", "scale_error")}
SCHEMA = Path(__file__).resolve().parents[3] / "shared" / "design" / "schema" / "diagnosis.schema.json"


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    swims = [*trials(), replace(trials()[0], name="held").with_role("holdout")]
    twin = Twin(shorter(), FISHSIM_MARKERS, workers=1)
    return diagnose(swims, twin, CAMERA, EFFECTS, discrepancy_for(FISHSIM_MARKERS, ROBOT), Settings("quick"))


@pytest.mark.long
def test_it_names_the_arm(found: Diagnosis) -> None:
    assert found.verdict.groups == (("crank_arm_error",),)
    assert found.refit is not None
    assert found.refit.values[0] == pytest.approx(ARM, abs=0.005)


def test_motor_logs_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    class Looked(Exception):
        pass

    def fitted(swims: list[MeasuredTrial], *_: object, **__: object) -> None:
        raise Looked([trial.turn for trial in swims])

    monkeypatch.setattr("diagnosis.diagnosis.Ground.fitted", fitted)
    even = CrankTurn.measured(np.linspace(0.0, 9.0, 99), np.linspace(0.0, 60.0, 99))
    logged = [replace(trial, turn=even, beat=trial.frequency) for trial in trials()]
    with pytest.raises(Looked) as looked:
        diagnose(logged, Twin(ROBOT, FISHSIM_MARKERS, workers=1), CAMERA, EFFECTS, np.eye(127))
    assert looked.value.args[0] == [None] * len(logged)


def test_small_matrices_wait_for_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    class Looked(Exception):
        pass

    def fitted(*_: object, **__: object) -> None:
        raise Looked([pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"])

    monkeypatch.setattr("diagnosis.diagnosis.Ground.fitted", fitted)
    with threadpool_limits(2), pytest.raises(Looked) as looked:
        diagnose(trials(), Twin(ROBOT, FISHSIM_MARKERS, workers=1), CAMERA, EFFECTS, np.eye(127))
    assert set(looked.value.args[0]) == {1}


@pytest.mark.long
def test_a_known_strength_is_recovered_from_a_wrong_start() -> None:
    arm = refit(ground("shorter"), [catalogue()["crank_arm_error"]], np.array([-0.02]), rounds=6)
    sd = np.sqrt(arm.covariance[5, 5])
    assert abs(arm.values[0] - ARM) < 4 * sd
    assert sd < ARM / 4


@pytest.mark.long
def test_the_gap_shrinks(found: Diagnosis) -> None:
    assert found.gap is not None
    assert found.gap.shrinkage.with_effects < found.gap.shrinkage.plain
    assert found.gap.after[0].marker_error_m < found.gap.before[0].marker_error_m
    assert found.gap.after[0].placed_error_m < found.gap.before[0].placed_error_m


@pytest.mark.long
def test_what_is_written_follows_the_contract(found: Diagnosis, tmp_path: Path) -> None:
    (path,) = DIAGNOSIS.write(tmp_path, Provenance("", "", {}, 0, "full"), diagnosis_result(found))
    for schema in [DIAGNOSIS.schema(), *([json.loads(SCHEMA.read_text())] if SCHEMA.exists() else [])]:
        jsonschema.validate(json.loads(path.read_text()), schema)
    read = DIAGNOSIS.read(tmp_path)
    assert read.effects == ("crank_arm_error",)
    assert "crank arm error" in sentences(read)[1]
    np.testing.assert_array_equal(read.missing_forces.mean, found.where.forces.mean)


@pytest.mark.long
def test_without_the_effect_in_the_catalogue_it_is_not_named() -> None:
    twin = Twin(shorter(), FISHSIM_MARKERS, workers=1)
    others = {name: effect for name, effect in EFFECTS.items() if name != "crank_arm_error"}
    told = diagnose(list(trials()), twin, CAMERA, others, discrepancy_for(FISHSIM_MARKERS, ROBOT), Settings("quick"))
    assert "crank_arm_error" not in told.probabilities.names
    assert told.verdict.name != "named"
    assert told.gap is None
