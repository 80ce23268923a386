import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swimcal.errors import InputError, ModelMismatch
from swimgym import Rules
from swimgym.course import make_course, numbers_of, start_of, steer
from swimgym.policy import Policy, SearchPlan, card_of, features, load_policy, reach, search, swim
from tests.swimgym.fish import fish

LAW = np.array([0.228, 0.996, 6.722, 0.459, -0.028, 0.246, 0.314, 0.092, -0.201, -0.379, -0.146, 0.029, -0.451])
"""Found by `calib policy train` on `datasets/sample`."""
PLAN = SearchPlan(generations=2, candidates=4, episodes=2, seconds=0.4)


def policy(law: np.ndarray = LAW) -> Policy:
    course = make_course("target", 1, fish=fish(), workers=1)
    return Policy(card_of("target", "search", fish(), course, 0), {"law": law})


@pytest.mark.long
def test_a_found_law_reaches_its_targets_from_all_sides() -> None:
    course = make_course("target", 24, fish=fish())
    swum = swim(course, policy().act, seed=1)
    assert swum.reached.all()
    assert swum.scores()["reached_ci95"][0] < 1.0  # type: ignore[index]


def test_left_and_right_mirror_each_other() -> None:
    seen = np.random.default_rng(0).normal(size=(50, 22))
    mirrored = seen.copy()
    # the crank half a turn on pulls to the other side; so turn all odd numbers of the mirror image
    mirrored[:, [0, 1, 3, 5, *range(6, 16), 18, 20]] *= -1
    np.testing.assert_allclose(steer(LAW, Rules(), seen), steer(LAW, Rules(), mirrored))


def test_a_law_for_each_swimmer_is_its_own() -> None:
    seen, quick = np.random.default_rng(0).normal(size=(2, 22)), Rules(acceleration_rad_s2=1e5)
    other = LAW + 0.3
    both = steer(np.array([LAW, other]), quick, seen)
    assert both[1] == steer(other, quick, seen)[1] != steer(LAW, quick, seen)[1]
    assert len(numbers_of(5)) == len(start_of("target", 5)[0]) == len(LAW)


@pytest.mark.parametrize("kind", ["law", "network"])
def test_a_saved_policy_does_the_same(kind: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    weights = {"weight_0": rng.normal(size=(8, 24)), "bias_0": rng.normal(size=8), "weight_1": rng.normal(size=(2, 8))}
    arrays = {"law": LAW} if kind == "law" else {**weights, "bias_1": np.zeros(2)}
    made = replace(policy(), arrays=arrays).scored({"reached": 1.0})
    made.save(tmp_path / "target.npz")
    read, seen = load_policy(tmp_path / "target.npz"), rng.normal(size=(5, 22))
    np.testing.assert_array_equal(read.act(seen), made.act(seen))
    assert read.card == made.card
    assert np.abs(read.act(seen)).max() <= 1.0
    assert features(seen).shape == (5, 24)


def test_a_policy_needs_no_torch() -> None:
    code = "import sys; import swimgym.policy; print('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "False\n"


def test_another_robot_or_engine_is_refused() -> None:
    course = make_course("target", 1, fish=fish(), workers=1)
    own = policy()
    own.check(fish(), course)
    with pytest.raises(ModelMismatch, match=r"robot: trained with eel, here fish_057.*calib policy train"):
        replace(own, card=replace(own.card, robot="eel")).check(fish(), course)
    with pytest.raises(ModelMismatch, match=r"MuJoCo: trained with 3\.1\.2"):
        replace(own, card=replace(own.card, mujoco="3.1.2")).check(fish(), course)


def test_what_is_no_policy_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no such policy.*calib policy train"):
        load_policy(tmp_path / "target.npz")
    policy().save(tmp_path / "target.npz")
    card = json.loads((tmp_path / "target.json").read_text())
    (tmp_path / "target.json").write_text(json.dumps({**card, "schema": 99}))
    with pytest.raises(InputError, match="found schema 99; expected a policy with a card of schema 1"):
        load_policy(tmp_path / "target.npz")


def test_a_target_out_of_reach_is_an_error() -> None:
    course = make_course("target", 1, fish=fish(), workers=1, seconds=1.0)
    with pytest.raises(InputError, match=r"target: -2, 0: out of reach of this policy; found 1\.\d+ m away"):
        reach(course, policy().act, (-2.0, 0.0))
    with pytest.raises(InputError, match="no target to swim to; found nan, 0"):
        reach(course, policy().act, (float("nan"), 0.0))


def test_a_search_that_was_stopped_goes_on_to_the_same(tmp_path: Path) -> None:
    whole = search(fish(), "circle", PLAN, workers=1)

    def stop(_message: str, share: float | None) -> None:
        if share == 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search(fish(), "circle", PLAN, state_file=tmp_path / "state.json", workers=1, progress=stop)
    resumed = search(fish(), "circle", PLAN, state_file=tmp_path / "state.json", workers=1)
    np.testing.assert_array_equal(resumed.arrays["law"], whole.arrays["law"])
    other = replace(PLAN, seed=1)
    anew = search(fish(), "circle", other, state_file=tmp_path / "state.json", workers=1)
    assert not np.array_equal(anew.arrays["law"], whole.arrays["law"])
