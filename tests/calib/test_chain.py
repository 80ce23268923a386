"""`calib fit` on a session with dry experiments: stiffness -> crank -> swims -> fluid, reported and kept."""

import json
import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from calib.viewer import _record_trial
from swimcal.robot import load_robot
from swimcal.runs import model_sha256
from swimsynth.disturbances import SyntheticMotor
from swimsynth.session import make_session
from tests.calib.door import Front, assert_public_form, assert_reports, calibration_of, edit, with_little_effort
from tests.calib.test_left_out import change_tracks, lose_the_tail, only
from tests.calib.test_run import remade, results_of
from tests.fitting.structure.experiments import DESCRIBED, PLAN, TRUE, with_few_points

STRUCTURE = {"structure.json", "structure.npz"}
TRACKS = {f"tracks/{name}.csv" for name in ("slow", "fast", "dry_slow", "dry_fast", "pull")}
KEYS = {
    "hinge_stiffness": ("hinge_stiffness_n_m", DESCRIBED.tail.hinge_stiffness_n_m),
    "hinge_damping": ("hinge_damping_n_m_s", DESCRIBED.tail.hinge_damping_n_m_s),
    "crank_arm": ("arm_m", DESCRIBED.crank.arm_m),
}


@pytest.fixture(autouse=True)
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    with_few_points(monkeypatch)


@pytest.fixture(scope="module")
def fitted_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fitted; its robot file is wrong about hinges and crank."""
    folder = make_session(tmp_path_factory.mktemp("chain") / "pool", PLAN)
    for quantity, (key, described) in KEYS.items():
        edit(folder / "robot.toml", f"\n{key} = {TRUE[quantity]}", f"\n{key} = {described}")
    with pytest.MonkeyPatch.context() as patch:
        with_little_effort(patch)
        with_few_points(patch)
        Pipeline(open_session(folder), Options("quick")).fit()
    return folder


@pytest.fixture
def unfitted(fitted: Path) -> Path:
    shutil.rmtree(fitted / "results")
    return fitted


def stand_still(position_px: np.ndarray) -> None:
    position_px[:] = position_px[:1]


def test_a_trial_that_cannot_be_measured_is_told_when_the_tracks_are_read(calib: Front, unfitted: Path) -> None:
    change_tracks(only(unfitted, "slow", "fast"), "fast", stand_still)
    outcome = calib("track", unfitted)
    assert outcome.code == 0
    (told,) = [line for line in outcome.out.splitlines() if line.startswith("!")]
    assert told.startswith("! fast is left out: ")
    assert "left out (1)" in outcome.out


def test_the_swims_are_fitted_with_what_was_measured(fitted: Path) -> None:
    data = calibration_of(fitted)
    model = mujoco.MjModel.from_xml_path(str(fitted / "results" / "calibrated.xml"))

    assert data["hinge_stiffness"] == data["structure"]["hinge_stiffness"]["value"]
    assert data["crank_arm_m"] == data["structure"]["crank_arm"]["value"]
    for quantity, true in TRUE.items():
        found = data["structure"][quantity]
        assert found["trials"]
        assert abs(found["value"] - true) < 3 * found["se"]
    np.testing.assert_allclose(model.joint("tail_1").stiffness, data["hinge_stiffness"], rtol=1e-5)
    assert {name: one["used"] for name, one in data["experiments"].items()} == dict.fromkeys(
        ("pull", "dry_slow", "dry_fast"), True
    )
    assert set(data["trials"]) == {"slow", "fast"}


def test_every_result_stands_and_the_model_is_that_of_the_description(fitted: Path) -> None:
    assert results_of(fitted).keys() == {"calibration.json", "calibrated.xml"} | STRUCTURE | TRACKS
    for name in ("calibration.json", "structure.json"):
        data = json.loads((fitted / "results" / name).read_text())
        assert data["model_sha256"] == model_sha256(load_robot(fitted / "robot.toml"))
        assert "trials/pull.csv.gz" in data["inputs"]
    assert_public_form(fitted)


def test_it_tells_what_was_taken_from_where(calib: Front, fitted: Path) -> None:
    lines = calib("fit", fitted, "--effort", "quick", "-v").out.splitlines()

    for sentence in ("(standard error) from free decay pull", "(standard error) from dry runs dry_slow, dry_fast"):
        assert [line for line in lines if line.endswith(sentence)]
    reported = json.loads(calib("fit", fitted, "--effort", "quick", "--json").out)
    assert reported["calibration"]["structure"]["hinge_stiffness"]["trials"] == ["pull"]


@pytest.mark.long
def test_another_search_does_not_find_the_structure_again(calib: Front, fitted: Path) -> None:
    before = calibration_of(fitted)
    with remade(fitted, "calibration.json", "calibrated.xml"):
        assert calib("fit", fitted, "--effort", "full").code == 0
    assert calibration_of(fitted)["structure"] == before["structure"]


@pytest.mark.long
def test_a_missing_decay_is_assumed_and_reported(calib: Front, unfitted: Path) -> None:
    outcome = calib("fit", only(unfitted, "slow", "fast", "dry_fast"), "--effort", "quick", "-v")
    data = calibration_of(unfitted)

    assert outcome.code == 0, outcome.err
    assert "no free decay: hinge stiffness 0.65 N m/rad as in robot.toml" in outcome.out
    assert {quantity: not source["trials"] for quantity, source in data["structure"].items()} == {
        "hinge_stiffness": True,
        "hinge_damping": True,
        "crank_arm": False,
    }


@pytest.mark.long
def test_a_session_without_a_swim_gives_the_structure_alone(calib: Front, unfitted: Path) -> None:
    only(unfitted, "dry_slow", "dry_fast", "pull")

    outcome = calib("fit", unfitted)
    assert outcome.code == 0, outcome.err
    assert "no swim trial to fit" in outcome.out
    assert "(standard error) from dry runs dry_slow, dry_fast" in outcome.out
    assert outcome.out.splitlines()[-1].endswith("structure.json")
    assert results_of(unfitted).keys() == STRUCTURE | {
        f"tracks/{name}.csv" for name in ("dry_slow", "dry_fast", "pull")
    }
    with remade(unfitted):
        reported = json.loads(calib("fit", unfitted, "--json").out)
    assert [source["quantity"] for source in reported["structure"]["sources"]] == list(KEYS)


@pytest.mark.long
def test_what_needs_a_swim_says_so_once_the_structure_stands(calib: Front, unfitted: Path) -> None:
    only(unfitted, "pull")

    outcome = calib("run", unfitted, "--effort", "quick", "--until", "fit")
    assert outcome.code == 0
    assert "no swim trial to fit" in outcome.out
    assert_reports(calib("posterior", unfitted), "no swim with tracks", "found pull (free_decay)")
    assert results_of(unfitted).keys() >= STRUCTURE


@pytest.mark.long
def test_an_experiment_that_cannot_be_measured_is_left_out_and_reported(calib: Front, unfitted: Path) -> None:
    change_tracks(only(unfitted, "pull", "dry_fast"), "pull", stand_still)
    outcome = calib("fit", unfitted, "--effort", "quick", "-v")

    assert outcome.code == 0, outcome.err
    assert "free decay pull is not used: its tail swings by 0.0 mm only" in outcome.out.lower()
    assert "free decay pull not used: hinge stiffness 0.65 N m/rad as in robot.toml" in outcome.out
    sources = json.loads((unfitted / "results" / "structure.json").read_text())["sources"]
    measured = {source["quantity"]: bool(source["trials"]) for source in sources}
    assert measured == {"hinge_stiffness": False, "hinge_damping": False, "crank_arm": True}
    with remade(unfitted):
        assert calib("fit", unfitted, "--effort", "quick").code == 0


def test_an_experiment_that_is_held_out_is_not_used(calib: Front, unfitted: Path) -> None:
    edit(only(unfitted, "pull") / "session.toml", 'role = "fit"', 'role = "holdout"')
    outcome = calib("fit", unfitted, "--effort", "quick", "-v")

    assert outcome.code == 0, outcome.err
    assert '! free decay pull is not used: its role in session.toml is "holdout"' in outcome.out
    assert "free decay pull not used: hinge stiffness 0.65 N m/rad as in robot.toml" in outcome.out


@pytest.mark.long
def test_what_is_wrong_with_any_trial_is_reported_at_once(calib: Front, unfitted: Path) -> None:
    change_tracks(unfitted, "pull", stand_still)
    change_tracks(unfitted, "dry_fast", lose_the_tail)
    change_tracks(unfitted, "slow", lose_the_tail)
    outcome = calib("fit", unfitted, "--effort", "quick")

    assert_reports(outcome, "trial pull: its tail swings by 0.0 mm only", "trial dry_fast:", "trial slow:")
    assert not STRUCTURE & results_of(unfitted).keys()


@pytest.mark.long
def test_an_experiment_that_is_not_believed_is_reported(calib: Front, unfitted: Path) -> None:
    def shake(position_px: np.ndarray) -> None:
        position_px[:, 3:] += np.random.default_rng(0).normal(0.0, 6.0, position_px[:, 3:].shape)

    change_tracks(only(unfitted, "slow", "pull"), "pull", shake)
    outcome = calib("fit", unfitted, "--effort", "quick", "-v")
    data = calibration_of(unfitted)

    assert outcome.code == 0, outcome.err
    assert "free decay pull not used: hinge stiffness 0.65 N m/rad as in robot.toml" in outcome.out
    assert "no dry run: crank arm 39.5 mm as in robot.toml" in outcome.out
    assert "! Free decay pull is not used: the twin explains only" in outcome.out
    assert data["experiments"]["pull"]["used"] is False
    assert "not_used" in [flag["kind"] for flag in data["flags"]]


@pytest.mark.long
def test_a_trial_with_a_motor_log_is_shown_next_to_the_frames_it_was_measured_from(tmp_path: Path) -> None:
    """Only the steady drive is compared: the twin are next to those frames of the recording, and next to no other."""
    swim = PLAN.trials[0].model_copy(update={"seconds": 17.0, "motor": SyntheticMotor(drive_s=5.0)})
    plan = PLAN.model_copy(update={"trials": (swim,), "dry_runs": (), "free_decays": ()})
    folder = make_session(tmp_path / "pool", plan)
    Pipeline(open_session(folder), Options("quick")).fit()
    pipeline = Pipeline(open_session(folder))
    (fitted,) = pipeline.the_fit().read().trials

    shown = _record_trial(pipeline, pipeline.session.trial("slow"), fitted)
    assert shown.residual_mm is not None
    compared = np.flatnonzero(np.isfinite(shown.residual_mm).any(axis=1))
    assert fitted.measured.first_frame > 60
    assert compared[0] == fitted.measured.first_frame + np.flatnonzero(fitted.measured.kept)[0]
    assert np.nanmean(shown.residual_mm) == pytest.approx(1000 * fitted.scores.marker_error_all_m, rel=1e-6)
