import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from swimgym.environments import SwimEnv, SwimVectorEnv
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


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([np.nan], r"action: found nan at \[0\], expected finite numbers from -1 to 1"),
        ([np.inf], r"action: found inf at \[0\]"),
        (0.5, r"action: found the shape \(\), expected \(1,\)"),
        ([0.1, 0.2], r"action: found the shape \(2,\), expected \(1,\)"),
        ("fast", "action: found 'fast', expected an array of numbers"),
        ([[0.1], [0.1, 0.2]], "expected an array of numbers"),
    ],
)
def test_an_action_that_is_none_is_refused_and_the_fish_stays_where_it_is(action: object, message: str) -> None:
    env = SwimEnv(fish=fish())
    env.reset(seed=0)
    before = env.course.swimmers.state
    with pytest.raises(ValueError, match=message):
        env.step(action)  # type: ignore[arg-type]
    np.testing.assert_array_equal(env.course.swimmers.state, before)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros(3), r"found the shape \(3,\), expected \(3, 1\)"),
        (np.zeros((1, 3)), r"found the shape \(1, 3\), expected \(3, 1\)"),
        (np.zeros((2, 1)), r"found the shape \(2, 1\), expected \(3, 1\)"),
        (np.array([[0.0], [np.nan], [0.0]]), r"found nan at \[1, 0\]"),
    ],
)
def test_actions_of_a_batch_that_are_none_are_refused(actions: np.ndarray, message: str) -> None:
    many = SwimVectorEnv(3, fish=fish(), workers=1)
    many.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        many.step(actions)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target_m": (1.0, 2.0, 3.0)}, r"target_m: found the shape \(3,\), expected finite x and y in m, \(2,\)"),
        ({"target_m": 1.0}, r"target_m: found the shape \(\)"),
        ({"target_m": (1.0, np.nan)}, r"target_m: found \[1.0, nan\], expected finite"),
        ({"target_m": "there"}, "target_m: found 'there', expected x and y in m"),
        ({"target": (1.0, 2.0)}, "options: found 'target', expected 'target_m' or nothing"),
    ],
)
def test_options_that_are_none_are_refused(options: dict[str, object], message: str) -> None:
    for env in (SwimEnv(fish=fish()), SwimVectorEnv(3, fish=fish(), workers=1)):
        with pytest.raises(ValueError, match=message):
            env.reset(seed=0, options=options)
    with pytest.raises(ValueError, match="on a circle"):
        SwimEnv("circle", fish=fish()).reset(options={"target_m": (1.0, 0.0)})


def test_seeds_of_a_batch_are_those_of_single_swimmers_episode_by_episode() -> None:
    seeds, alone = [7, 3, 11], SwimEnv(fish=fish(), seconds=0.1)
    many = SwimVectorEnv(3, fish=fish(), workers=1, seconds=0.1)
    seen, _ = many.reset(seed=seeds)
    for _ in range(5):  # to the end of the episode
        again, *_ = many.step(np.zeros((3, 1), np.float32))
    for row, seed in enumerate(seeds):
        np.testing.assert_array_equal(alone.reset(seed=seed)[0], seen[row])
        np.testing.assert_array_equal(alone.reset()[0], again[row])
    np.testing.assert_array_equal(many.reset(seed=np.array(seeds))[0], seen)
    assert not np.array_equal(many.reset(seed=7)[0], seen)
    with pytest.raises(ValueError, match="seed: found 2 seeds, expected one number, or one for each of 3"):
        many.reset(seed=[1, 2])


def test_targets_of_a_batch_hold_for_the_episodes_that_begin_with_them() -> None:
    many = SwimVectorEnv(2, fish=fish(), workers=1, seconds=0.1)
    seen, _ = many.reset(seed=0, options={"target_m": [(-0.3, 0.4), (-0.6, 0.8)]})
    np.testing.assert_allclose(seen[:, 16], [0.5, 1.0], atol=1e-6)
    for _ in range(5):
        seen, *_ = many.step(np.zeros((2, 1), np.float32))
    assert not np.isclose(seen[:, 16], [0.5, 1.0], atol=0.05).all()
