import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from swimgym.environment import SwimEnv
from swimgym.vector_environment import SwimVectorEnv
from tests.swimgym.fish import fish


@pytest.mark.parametrize("name", ["Target", "Circle"])
def test_gymnasiums_checker_passes(name: str) -> None:
    env = gymnasium.make(f"swimgym:swimgym/{name}-v0", fish=fish(), render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*Box observation space m")  # SI units have no bounds
        check_env(env.unwrapped)


def test_the_checker_of_stable_baselines_passes() -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(SwimEnv(fish=fish()))


def test_a_seed_reproduces_an_episode() -> None:
    def swum(seed: int) -> np.ndarray:
        env = SwimEnv(fish=fish())
        first, _ = env.reset(seed=seed)
        env.action_space.seed(0)
        return np.array([first, *(env.step(env.action_space.sample())[0] for _ in range(30))])

    np.testing.assert_array_equal(swum(3), swum(3))
    assert not np.array_equal(swum(3), swum(4))


def test_a_target_of_ones_own_and_its_end() -> None:
    env = SwimEnv(fish=fish())
    seen, _ = env.reset(seed=0, options={"target_m": (-0.03, 0.04)})
    assert seen[16] == pytest.approx(0.05)
    _, reward, ended, cut, info = env.step(np.zeros(1, np.float32))
    assert (ended, cut, bool(info["is_success"])) == (True, False, True)
    assert reward == pytest.approx(300 - info["distance_m"])


def test_an_episode_is_cut_off_in_time() -> None:
    env = SwimEnv("circle", fish=fish(), seconds=0.1)
    env.reset(seed=0)
    cuts = [env.step(np.zeros(1, np.float32))[3] for _ in range(5)]
    assert cuts == [False] * 4 + [True]


def test_swimmers_of_a_batch_are_single_ones() -> None:
    many = gymnasium.make_vec(
        "swimgym:swimgym/Target-v0", 3, vectorization_mode="vector_entry_point", fish=fish(), workers=2
    )
    assert isinstance(many, SwimVectorEnv)
    many.reset(seed=5)
    alone = SwimEnv(fish=fish())
    alone.reset(seed=0, options={"target_m": tuple(many.course.task.places[1])})  # type: ignore[attr-defined]
    many.action_space.seed(0)
    for _ in range(40):
        actions = many.action_space.sample()
        seen, reward, *_ = many.step(actions)
        own, own_reward, *_ = alone.step(actions[1])
        np.testing.assert_array_equal(seen[1], own)
        assert reward[1] == pytest.approx(own_reward)


def test_where_an_episode_of_a_batch_ends_the_next_begins() -> None:
    many = SwimVectorEnv(2, fish=fish(), workers=1)
    many.reset(seed=0)
    many.course.task.places[1] = 0.03, 0.0  # type: ignore[attr-defined]
    seen, _, ended, cut, infos = many.step(np.zeros((2, 1), np.float32))
    assert ended.tolist() == [False, True] == infos["_final_obs"].tolist()
    assert not cut.any()
    assert infos["final_obs"][1, 16] < 0.05 < seen[1, 16]
    np.testing.assert_array_equal(infos["final_obs"][0], seen[0])
