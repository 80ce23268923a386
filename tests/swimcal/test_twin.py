from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from swimcal import twin as twin_module
from swimcal.mjcf import DRY, SWIM, Scene, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.runs import MarkerKinematics, Runs, Trajectories
from swimcal.twin import Twin
from tests.swimcal.engine_state import random_state
from tests.swimcal.robots import FISH, every_robot
from tests.swimcal.swims import random_runs, runs

FRAMES = np.arange(0, 1.5, 1 / 60)


def stepped(twin: Twin, one: Runs, steps: int) -> np.ndarray:
    """(steps + 1, nq) positions of a single simulation, by `mj_step` on a model of its own."""
    model = build_mjcf(twin.robot, scene=twin.scene).compile()
    model.geom_fluid[model.geom_fluid[:, 0] > 0, 1:6] = one.coefficients[0]
    for name, values in one.fields.items():
        getattr(model, name)[:] = values[0]
    data = mujoco.MjData(model)
    position, velocity = twin.start(one)
    data.qpos[:], data.qvel[:] = position[0], velocity[0]
    data.ctrl[0] = 2 * np.pi * one.frequency_hz[0]
    states = [data.qpos.copy()]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        states.append(data.qpos.copy())
    return np.array(states)


def alone(many: Runs, i: int) -> Runs:
    rows = slice(i, i + 1)
    return Runs(
        many.coefficients[rows],
        many.frequency_hz[rows],
        many.phase_rad[rows],
        None if many.velocity is None else many.velocity[rows],
        {name: values[rows] for name, values in many.fields.items()},
    )


def joined(swum: Trajectories, i: int) -> np.ndarray:
    """(f, nq) the joint positions of one simulation, in the order of the model."""
    return np.concatenate([swum.head[i], swum.crank_rad[i][:, None], swum.hinges_rad[i]], axis=1)


def assert_identical(one: Trajectories, other: Trajectories) -> None:
    for name in ("marker_m", "head", "hinges_rad", "crank_rad", "diverged"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@every_robot
def test_the_batch_equals_a_plain_loop_of_mj_step(robot: RobotSpec) -> None:
    """Each with its own coefficients, frequency, phase, initial velocity, stiffness and tendons."""
    twin, n, steps = Twin(robot), 3, 300
    rng = np.random.default_rng(0)
    many = random_runs(
        n,
        seed=1,
        velocity=rng.normal(0, 0.1, (n, 3)),
        fields={
            "jnt_stiffness": twin.model.jnt_stiffness * rng.uniform(0.7, 1.4, (n, 1)),
            "tendon_stiffness": twin.model.tendon_stiffness * rng.uniform(0.5, 1.0, (n, 1)),
        },
    )
    swum = twin.simulate(many, np.arange(steps) * twin.scene.timestep_s)
    for i in range(n):
        expected = stepped(twin, alone(many, i), steps - 1)
        np.testing.assert_allclose(joined(swum, i), expected, rtol=0, atol=1e-12)


def test_a_field_of_one_simulation_does_not_touch_another_nor_the_next_call() -> None:
    twin = Twin(FISH)
    two = random_runs(2, seed=2)
    plain = twin.simulate(two, FRAMES)
    stiffness = np.stack([twin.model.jnt_stiffness, twin.model.jnt_stiffness * 3])
    changed = twin.simulate(replace(two, fields={"jnt_stiffness": stiffness}), FRAMES)
    np.testing.assert_array_equal(changed.marker_m[0], plain.marker_m[0])
    assert np.abs(changed.hinges_rad[1] - plain.hinges_rad[1]).max() > 0.01
    assert_identical(twin.simulate(two, FRAMES), plain)


def test_result_does_not_depend_on_chunks_or_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    many = random_runs(7, seed=4, velocity=np.full((7, 3), 0.01), fields={"jnt_stiffness": np.full((7, 9), 0.5)})
    whole = Twin(FISH).simulate(many, FRAMES)
    assert_identical(Twin(FISH, workers=1).simulate(many, FRAMES), whole)
    monkeypatch.setattr(twin_module, "_CHUNK", 3)
    in_chunks = Twin(FISH, workers=2).simulate(many, FRAMES)
    assert_identical(in_chunks, whole)
    own_times = np.tile(FRAMES, (7, 1))
    assert_identical(Twin(FISH).simulate(many, own_times), whole)


@every_robot
def test_half_a_turn_of_phase_mirrors_the_swim(robot: RobotSpec) -> None:
    middle = tuple(name for name, marker in robot.markers.items() if marker.position_m[1] == 0)
    swum = Twin(robot, middle).simulate(runs([1.0, 1.0], [0.9, 0.9 + np.pi]), FRAMES)
    np.testing.assert_allclose(swum.marker_m[1], swum.marker_m[0] * [1, -1], atol=5e-4)
    assert np.abs(swum.marker_m[0, ..., 1]).max() > 0.02


def test_at_a_quarter_turn_the_crank_has_pulled_the_tail_to_the_left() -> None:
    """Heading is -x and z is up, so left is -y."""
    twin = Twin(FISH, ("nose", "caudal_fin"), scene=DRY)
    swum = twin.simulate(runs(np.full(4, 0.5), [0.0, np.pi / 2, np.pi, 3 * np.pi / 2]), np.zeros(1))
    straight, left, back, right = swum.marker_m[:, 0, 1, 1]
    assert left < -0.08
    assert right > 0.08
    assert abs(straight) < 1e-3
    assert abs(back) < 1e-3


def test_the_head_starts_at_the_origin_with_the_velocity_asked_for() -> None:
    velocity, step = np.array([[-0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 1.5]]), 1e-4
    twin = Twin(FISH, scene=replace(SWIM, timestep_s=step))
    swum = twin.simulate(runs(np.full(3, 0.5), velocity=velocity), np.array([0.0, step]))
    still = twin.simulate(runs(0.5), np.array([step])).head[0, 0]
    np.testing.assert_allclose(swum.head[:, 0], 0.0, atol=1e-15)
    np.testing.assert_allclose((swum.head[:, 1] - still) / step, velocity, atol=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"coefficients": np.zeros((2, 4))}, r"coefficients: found shape \(2, 4\), expected \(2, 5\)"),
        ({"phase_rad": np.zeros(3)}, r"phase_rad: found shape \(3,\), expected \(2,\) for 2 simulations"),
        ({"velocity": np.zeros(3)}, r"velocity: found shape \(3,\), expected \(2, 3\)"),
        (
            {"fields": {"jnt_stiffness": np.zeros(9)}},
            r"fields\['jnt_stiffness'\]: found shape \(9,\), expected \(2, ...\) for 2 simulations",
        ),
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(random_runs(2, seed=0), **change)


def test_a_time_before_the_start_is_refused() -> None:
    with pytest.raises(ValueError, match=r"found -0.1 s, expected times from 0"):
        Twin(FISH).simulate(runs(1.0), np.array([-0.1, 0.0]))


def test_runs_that_are_equal_are_simulated_once_and_each_is_read_at_its_own_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    twin = Twin(FISH)
    simulated: list[int] = []
    inner = Twin._states

    def counted(self: Twin, some: Runs, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        simulated.append(len(some))
        return inner(self, some, steps)

    monkeypatch.setattr(Twin, "_states", counted)
    both = runs([1.0, 1.0, 1.3, 1.0], [0.9, 0.9, 0.9, 1.0])
    times = FRAMES + np.array([0.0, 0.01, 0.0, 0.0])[:, None]
    swum = twin.simulate(both, times)
    assert simulated == [3]
    for row in range(4):
        alone = twin.simulate(both.part(np.array([row])), times[row])
        np.testing.assert_array_equal(swum.marker_m[row], alone.marker_m[0])


@pytest.mark.parametrize("scene", [SWIM, DRY], ids=["swim", "dry"])
@every_robot
def test_markers_are_where_the_engine_has_them(robot: RobotSpec, scene: Scene) -> None:
    names = tuple(reversed(robot.markers))
    model = build_mjcf(robot, scene=scene).compile()
    states = [random_state(model, seed) for seed in range(20)]
    hinges = np.array([[d.joint(name).qpos[0] for name in robot.hinges] for d in states])  # (20, h)
    head = np.zeros((20, 3)) if scene.head_clamped else np.array([d.qpos[:3] for d in states])

    places = MarkerKinematics(robot, names)(head, hinges)  # (20, m, 2)

    expected = [[data.site(f"marker_{name}").xpos[:2] for name in names] for data in states]
    np.testing.assert_allclose(places, expected, atol=1e-12)
