import numpy as np
import pytest

from benchmarks.reality.layout import lay_out
from swimcal.mjcf import build_mjcf
from swimcal.robot import RobotSpec
from tests.swimcal.effects.test_structure import about_hinge
from tests.swimcal.robots import every_robot


@every_robot
def test_with_one_hinge_a_gap_links_weigh_what_the_twins_weigh(robot: RobotSpec) -> None:
    layout, model = lay_out(robot, hinges_per_gap=1), build_mjcf(robot).compile()
    links = [model.body(name) for name in robot.hinges]
    np.testing.assert_allclose(layout.mass_kg[1:], [link.mass[0] for link in links], rtol=1e-9)
    np.testing.assert_allclose(layout.mass_kg[1:], robot.tail_mass_kg, rtol=1e-9)
    np.testing.assert_allclose(layout.moment_kg_m[1:], [link.mass[0] * link.ipos[0] for link in links], rtol=1e-9)
    np.testing.assert_allclose(
        layout.inertia_kg_m2[1:], [about_hinge(model, name) for name in robot.hinges], rtol=3e-4
    )  # strips have no thickness there


@every_robot
def test_more_hinges_a_gap_leave_the_mass_and_its_moment_as_they_are(robot: RobotSpec) -> None:
    one, two = lay_out(robot, 1), lay_out(robot, 2)
    moments = [(cut.moment_kg_m + cut.mass_kg * cut.origin_m).sum() for cut in (one, two)]
    assert two.mass_kg.sum() == pytest.approx(one.mass_kg.sum(), rel=1e-12)
    assert moments[1] == pytest.approx(moments[0], rel=1e-12)
