import mujoco
import numpy as np
import pytest

from swimcal.mjcf import DRY, SWIM, Scene, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.runs import MarkerKinematics
from tests.swimcal.engine_state import random_state
from tests.swimcal.robots import every_robot


def sites(data: mujoco.MjData, names: tuple[str, ...]) -> np.ndarray:
    """(m, 2) where the engine has the markers."""
    return np.array([data.site(f"marker_{name}").xpos[:2] for name in names])


@pytest.mark.parametrize("scene", [SWIM, DRY], ids=["swim", "dry"])
@every_robot
def test_markers_are_where_the_engine_has_them(robot: RobotSpec, scene: Scene) -> None:
    names = tuple(reversed(robot.markers))
    model = build_mjcf(robot, scene=scene).compile()
    states = [random_state(model, seed) for seed in range(20)]
    hinges = np.array([[d.joint(name).qpos[0] for name in robot.hinges] for d in states])  # (20, h)
    head = np.zeros((20, 3)) if scene.head_clamped else np.array([d.qpos[:3] for d in states])

    places = MarkerKinematics(robot, names)(head, hinges)  # (20, m, 2)

    expected = np.array([sites(data, names) for data in states])
    np.testing.assert_allclose(places, expected, atol=1e-12)
