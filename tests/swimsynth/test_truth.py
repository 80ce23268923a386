import json
from pathlib import Path

import mujoco

from swimsynth.session import make_session, read_truth
from tests.swimsynth.plans import files_of, small_plan


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
