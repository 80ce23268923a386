"""`calib run`: what it writes, what it skips, what it makes again, how it can be stopped."""

import gzip
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco
import numpy as np
import pytest

from swimcal.stage import session_lock
from tests.calib.door import Front, assert_public_form, assert_reports, calibration_of, edit, files_in, little_posterior
from tests.reports.page import nothing_drawn

FIT = {"calibration.json", "calibrated.xml", "tracks/slow.csv", "tracks/fast.csv"}
RESULTS = FIT | {"report.html"}


def results_of(folder: Path) -> dict[str, int]:
    """The time of writing of each result of the contract."""
    aside = (".", "kept/")
    return {name: written for name, written in files_in(folder / "results").items() if not name.startswith(aside)}


@contextmanager
def remade(folder: Path, *expected: str) -> Iterator[None]:
    """Exactly these results are written within the block."""
    before = results_of(folder)
    yield
    after = results_of(folder)
    assert {name for name in after if after[name] != before.get(name)} == set(expected)


@pytest.mark.usefixtures("true_report")
def test_it_writes_every_result_and_names_the_report_last(calib: Front, fresh: Path) -> None:
    with nothing_drawn():
        outcome = calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert outcome.code == 0
    assert results_of(fresh).keys() == RESULTS
    assert len(outcome.out.splitlines()) <= 8
    assert outcome.out.splitlines()[-1] == str(fresh / "results" / "report.html")
    assert "Verdict" in outcome.out
    assert "Next: calib" in outcome.out


@pytest.mark.long
def test_full_effort_makes_all_again_and_tells_how_sure_it_is(
    calib: Front, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    little_posterior(monkeypatch)
    with remade(
        finished, *RESULTS - {"tracks/slow.csv", "tracks/fast.csv"}, "posterior.nc", "posterior.json", "diagnosis.json"
    ):
        calib("run", finished, "--effort", "full")
    assert calibration_of(finished)["effort"] == "full"


@pytest.mark.long
@pytest.mark.parametrize("change", ["seed", "role", "tracks"])
def test_a_changed_input_makes_all_again(calib: Front, finished: Path, change: str) -> None:
    if change == "seed":
        edit(finished / "session.toml", "[fit]", "[fit]\nseed = 7")
    elif change == "role":
        edit(finished / "session.toml", 'role = "holdout"', 'role = "fit"')
    else:
        path = finished / "trials" / "slow.csv.gz"
        rows = gzip.decompress(path.read_bytes()).decode().splitlines(keepends=True)
        path.write_bytes(gzip.compress("".join(rows[:-1]).encode(), mtime=0))
    with remade(finished, *RESULTS):
        assert calib("run", finished, "--effort", "quick", "--until", "fit").code == 0


def test_json_is_all_there_is_on_standard_output(calib: Front, finished: Path) -> None:
    outcome = calib("run", finished, "--effort", "quick", "--until", "fit", "--json")
    reported = json.loads(outcome.out)

    assert outcome.err == ""
    assert reported["result"] == str(finished / "results" / "report.html")
    assert reported["made"] == []
    assert reported["calibration"] == calibration_of(finished)


def test_provenance_names_engine_inputs_and_effort(finished: Path) -> None:
    data = calibration_of(finished)

    assert list(data)[:7] == ["schema", "program", "mujoco", "model_sha256", "inputs", "seed", "effort"]
    assert data["mujoco"] == mujoco.__version__
    assert set(data["inputs"]) == {"session.toml", "trials/slow.csv.gz", "trials/fast.csv.gz"}
    assert data["effort"] == "quick"
    assert_public_form(finished)


def test_the_calibrated_file_swims_in_plain_mujoco(finished: Path) -> None:
    data = calibration_of(finished)
    model = mujoco.MjModel.from_xml_path(str(finished / "results" / "calibrated.xml"))
    state = mujoco.MjData(model)
    coefficients = list(data["coefficients"].values())
    fluid = model.geom_fluid[model.geom_fluid[:, 0] > 0, 1:6]

    assert [model.key(i).name for i in range(model.nkey)] == ["slow", "steady_swim"]
    np.testing.assert_allclose(fluid, np.tile(coefficients, (len(fluid), 1)), rtol=1e-5)
    mujoco.mj_resetDataKeyframe(model, state, 0)
    hz = data["trials"]["slow"]["frequency_hz"]
    assert state.ctrl[0] == pytest.approx(2 * np.pi * hz, rel=1e-5)
    assert state.joint("crank").qpos[0] == pytest.approx(data["trials"]["slow"]["phase_rad"], rel=1e-5)
    mujoco.mj_step(model, state, round(3.0 / model.opt.timestep))
    assert np.isfinite(state.qpos).all()
    assert state.time == pytest.approx(3.0, abs=model.opt.timestep)
    assert state.joint("surge").qpos[0] < -0.05
    assert state.joint("crank").qvel[0] == pytest.approx(2 * np.pi * hz, rel=0.02)


def test_from_its_last_keyframe_the_calibrated_file_swims_steadily_along_x_and_can_touch_a_wall(finished: Path) -> None:
    spec = mujoco.MjSpec.from_file(str(finished / "results" / "calibrated.xml"))
    assert "MuJoCo 3" in spec.comment
    spec.option.disableflags = 0
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 1, 2
    wall = {"pos": (-1.2, 0.0, 0.0), "size": (0.05, 3.0, 1.0), "contype": 2, "conaffinity": 1}
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, **wall)
    model = spec.compile()
    state = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, state, model.key("steady_swim").id)
    beat = round(2 * np.pi / state.ctrl[0] / model.opt.timestep)
    places = []
    for _ in range(4):
        mujoco.mj_step(model, state, beat)
        places.append(state.qpos[:3].copy())
    strides = np.diff(places, axis=0)[:, 0]
    assert (strides < 0).all()
    assert np.ptp(strides) < 0.05 * np.abs(strides).mean()
    assert abs(places[0][1]) < abs(places[0][0])  # it sets out along -x
    mujoco.mj_step(model, state, round(60.0 / model.opt.timestep))
    assert np.isfinite(state.qpos).all()
    assert state.qpos[0] > -1.2  # it would have been far beyond


def test_from_a_straight_tail_at_any_phase_the_calibrated_file_does_not_diverge(finished: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(finished / "results" / "calibrated.xml"))
    for phase in np.linspace(0, 2 * np.pi, 6, endpoint=False):
        state = mujoco.MjData(model)
        state.joint("crank").qpos[0], state.joint("crank").qvel[0] = phase, 2 * np.pi
        state.ctrl[0] = 2 * np.pi
        mujoco.mj_step(model, state, round(2.0 / model.opt.timestep))
        assert state.time == pytest.approx(2.0, abs=model.opt.timestep)  # the engine did not reset itself
        assert np.abs(state.qvel).max() < 50


def test_two_runs_at_once_are_refused(calib: Front, fresh: Path) -> None:
    with session_lock(fresh):
        assert_reports(calib("run", fresh), str(fresh), "is being worked on", "Wait for that run")
    assert results_of(fresh) == {}
