import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from swimcal.errors import InputError
from swimcal.robot import RobotSpec, load_robot
from swimcal.session import load_session
from swimcal.tracks import pixels_of
from swimsynth.disturbances import NOISELESS
from swimsynth.plan import SyntheticPlan, default_plan
from swimsynth.session import make_session, read_truth
from tests.cases import later
from tests.swimsynth.plans import FAST, files_of, measured, small_plan, tracks_of


def short_tailed_robot() -> RobotSpec:
    """Another swimmer: four tail segments instead of five, a longer nose, its own markers."""
    robot = load_robot().model_dump()
    robot["name"] = "short_tail"
    robot["tail"]["segment"] = robot["tail"]["segment"][:4]
    robot["markers"] = {name: marker for name, marker in robot["markers"].items() if marker["body"] != "tail_5"}
    robot["markers"]["nose"]["position_m"] = (-0.09, 0.0, 0.05)
    robot["markers"]["fin"] = {"body": "tail_4", "position_m": (0.45, 0.0, 0.1)}
    return RobotSpec.model_validate(robot)


def test_a_session_loads_without_a_fault_and_says_what_was_planned(tmp_path: Path) -> None:
    plan = small_plan(name="two swims")
    session = load_session(make_session(tmp_path / "s", plan), load_robot)

    assert (session.name, session.markers, session.warmup_s) == ("two swims", plan.markers, plan.warmup_s)
    for trial, planned in zip(session.trials, plan.trials, strict=True):
        assert (trial.name, trial.kind, trial.role) == (planned.name, "swim", planned.role)
        assert trial.commanded_hz == planned.commanded_hz
        assert len(tracks_of(session, trial.name).time.values) == len(planned.time_s(plan.camera))


@pytest.mark.parametrize("plan", [small_plan(), *later(default_plan(0), default_plan(1))])
def test_what_is_measured_in_a_session_is_its_truth(plan: SyntheticPlan, tmp_path: Path) -> None:
    folder = make_session(tmp_path / "s", plan)
    truth = read_truth(folder)

    for name, trial in measured(folder).items():
        assert trial.frequency.hz == pytest.approx(truth.trials[name].frequency_hz, rel=0.01)
        assert trial.speed == pytest.approx(truth.trials[name].speed_m_s, abs=0.006)
        assert truth.trials[name].speed_m_s > 0.05


def test_the_same_plan_gives_the_same_bytes(tmp_path: Path) -> None:
    one, two = (files_of(make_session(tmp_path / name, small_plan())) for name in ("one", "two"))

    assert one == two


def test_tracks_are_the_true_positions_with_the_errors_that_were_planned(tmp_path: Path) -> None:
    plan = small_plan(slow={"seconds": 20.0})
    noisy, clean = (
        make_session(tmp_path / name, plan.model_copy(update={"noise": noise}))
        for name, noise in (("noisy", plan.noise), ("clean", NOISELESS))
    )
    found, true = (pixels_of(tracks_of(load_session(folder), "slow")) for folder in (noisy, clean))
    offsets = np.array(list(read_truth(noisy).trials["slow"].placement_px.values()))

    errors = found - true - offsets
    assert errors.std() == pytest.approx(np.hypot(plan.noise.sd_px, 0.5 / np.sqrt(12)), rel=0.05)
    assert np.abs(errors.mean(axis=0)).max() < 0.2
    assert not np.any(list(read_truth(clean).trials["slow"].placement_px.values()))


def test_another_robot_comes_with_its_description(tmp_path: Path) -> None:
    robot = short_tailed_robot()
    markers = ("nose", "neck", "pectoral_left", "tail_2", "tail_4", "fin")
    folder = make_session(tmp_path / "s", small_plan(robot=robot, markers=markers))
    session = load_session(folder, load_robot)

    assert load_robot(session.robot_file) == robot
    assert session.camera.scale_length_m == pytest.approx(0.155)
    assert read_truth(folder).plan.swimmer == robot
    trial = measured(folder)["fast"]
    assert trial.frequency.hz == pytest.approx(FAST["frequency_hz"], rel=0.01)
    assert trial.flags == ()


def test_a_session_that_cannot_be_made_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the fish leaves the image"):
        make_session(tmp_path / "s", small_plan(slow={"start_px": (0.0, 0.0)}))
    assert list(tmp_path.iterdir()) == []


def test_the_truth_holds_the_plan_and_what_came_of_it(tmp_path: Path) -> None:
    plan = small_plan()
    folder = make_session(tmp_path / "s", plan)
    truth = read_truth(folder)
    raw = json.loads((folder / "truth.json").read_text())

    assert truth.plan == plan
    assert truth.mujoco == mujoco.__version__
    assert list(truth.trials) == ["slow", "fast"]
    assert raw["plan"]["coefficients"]["kutta_lift"] == plan.coefficients.kutta_lift


def test_a_session_can_be_made_again_from_its_truth(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "s", small_plan(seed=7))

    assert files_of(make_session(tmp_path / "again", read_truth(folder).plan)) == files_of(folder)
