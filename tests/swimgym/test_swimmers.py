from pathlib import Path

import mujoco
import numpy as np
import pytest

from swimcal.errors import InputError, ModelMismatch
from swimgym import Swimmers, load_fish
from tests.swimgym.fish import WATER, fish, session_with_fit


def test_a_batch_swims_as_the_engine_does_alone() -> None:
    swimmers = Swimmers(fish().models, 3, workers=1)
    model = fish().models[0]
    model.opt.timestep = swimmers.interval_s / swimmers.substeps
    data = mujoco.MjData(model)
    for k in range(20):
        swimmers.drive(np.full(3, 0.5 * k))
        data.ctrl[0] = 0.5 * k
        mujoco.mj_step(model, data, swimmers.substeps)
    assert swimmers.substeps == 5  # each 4 ms, no longer than the model's own
    np.testing.assert_array_equal(swimmers.head[1], data.qpos[:3])
    np.testing.assert_array_equal(swimmers.tail[0][2], data.qpos[4:])


def test_each_swimmer_has_its_own_water() -> None:
    waters = np.array([WATER, np.array(WATER) * [1, 3, 1, 1, 1]])
    swimmers = Swimmers(fish().with_coefficients(waters).models, 4, workers=1)
    for _ in range(100):
        swimmers.drive(np.full(4, 9.0))
    surge = swimmers.head[:, 0]
    assert surge[0] == surge[2] != surge[1] == surge[3]
    assert (surge < -0.1).all()  # forward is -x


def test_the_steered_point_moves_as_it_says() -> None:
    swimmers = Swimmers(fish().models, 2, interval_s=0.001, workers=1)
    swimmers.rest(np.arange(2), np.array([[1.0, 2.0], [-1.0, 0.5]]), np.array([0.3, 2.0]))
    np.testing.assert_allclose(swimmers.centre[0], [[1.0, 2.0], [-1.0, 0.5]])
    for _ in range(400):
        swimmers.drive(np.full(2, 12.0))
    before = swimmers.centre[0]
    swimmers.drive(np.full(2, 12.0))
    np.testing.assert_allclose((swimmers.centre[0] - before) / 0.001, swimmers.centre[1], atol=2e-3)


def test_a_session_gives_the_fish_it_was_calibrated_to(tmp_path: Path) -> None:
    found = load_fish(session_with_fit(tmp_path / "pool"))
    assert found.robot == fish().robot
    fluid = found.models[0].geom_fluid[found.models[0].geom_fluid[:, 0] > 0, 1:6]
    np.testing.assert_allclose(fluid, np.tile(WATER, (len(fluid), 1)))
    assert found.models[0].nsensor == 0


def test_another_engine_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelMismatch, match=r"made with MuJoCo 3\.1\.2.*calib fit"):
        load_fish(session_with_fit(tmp_path / "pool", engine="3.1.2"))


def test_what_is_no_fish_is_named(tmp_path: Path) -> None:
    pendulum = tmp_path / "pendulum.xml"
    body = '<body><joint name="swing"/><geom size="1"/></body>'
    pendulum.write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with pytest.raises(InputError, match=r"none of surge, sway, yaw, crank, tail_1, one actuator, body head"):
        load_fish(mjcf=pendulum)
    pendulum.write_text("<mujoco")
    with pytest.raises(InputError, match="it is no MJCF"):
        load_fish(mjcf=pendulum)
    with pytest.raises(InputError, match=r"there is no posterior.*calib posterior"):
        load_fish(session_with_fit(tmp_path / "pool"), draws=3)
    with pytest.raises(InputError, match="calib diagnose"):
        load_fish(tmp_path / "pool", effects=True)
    with pytest.raises(InputError, match="both"):
        load_fish(tmp_path, mjcf=pendulum)
