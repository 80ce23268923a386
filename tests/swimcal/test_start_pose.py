"""The tail starts where its tendons hold it, so that nothing is torn at any phase of the crank."""

import numpy as np

from swimcal.mjcf import DRY, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.twin import Twin
from tests.swimcal.engine_state import stretch
from tests.swimcal.robots import every_robot
from tests.swimcal.swims import runs

PHASES = np.linspace(0, 2 * np.pi, 25)


def hinges_at_start(robot: RobotSpec) -> np.ndarray:
    """(phases, h) hinge angles at time 0."""
    twin = Twin(robot)
    position, _ = twin.start(runs(np.full(len(PHASES), 0.5), PHASES))
    return position[:, 4:]


@every_robot
def test_tendons_are_near_their_rest_length_at_any_phase(robot: RobotSpec) -> None:
    """Within 3 %, where a straight tail would tear them by more than 9 %."""
    model = build_mjcf(robot, scene=DRY).compile()
    straight, held = [], []
    for phase, hinges in zip(PHASES, hinges_at_start(robot), strict=True):
        straight.append(stretch(model, robot, phase, np.zeros(len(hinges))))
        held.append(stretch(model, robot, phase, hinges))
    assert np.abs(held).max() < 0.03
    assert np.abs(straight).max() > 0.09


@every_robot
def test_the_tail_starts_moving_with_the_crank(robot: RobotSpec) -> None:
    """Its velocity is the derivative of the held pose along the crank's turn."""
    twin, speed, small = Twin(robot), 2 * np.pi * 0.8, 1e-4
    _, velocity = twin.start(runs(np.full(25, 0.8), PHASES))
    before, _ = twin.start(runs(np.full(25, 0.8), PHASES - small))
    after, _ = twin.start(runs(np.full(25, 0.8), PHASES + small))
    rate = (after - before)[:, 4:] / (2 * small) * speed
    np.testing.assert_allclose(velocity[:, 4:], rate, atol=1e-4)
    np.testing.assert_allclose(velocity[:, 3], speed)
