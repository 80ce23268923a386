"""Numbers that no swimmer has are named, and the robots that there are raise no doubt."""

from pathlib import Path

import pytest

from swimcal.robot import load_robot
from swimcal.robot_doubts import robot_doubts

FILE = Path(__file__).parents[3] / "swimcal/robots/fish_057.toml"


def test_the_published_robot_raises_no_doubt() -> None:
    assert robot_doubts(load_robot()) == ()


@pytest.mark.parametrize(
    ("table", "key", "value", "named"),
    [
        ("caudal_fin", "length_m", 5.6, "caudal_fin.length_m = 5.6"),
        ("caudal_fin", "chord_m", 3.6, "caudal_fin.chord_m = 3.6"),
        ("caudal_fin", "mass_kg", 9.0, "caudal_fin.mass_kg over the robot's mass: 0.8"),
        ("water", "density_kg_m3", 1.0, "water.density_kg_m3: 1,"),
        ("tail", "hinge_stiffness_n_m", 65.0, "tail.hinge_stiffness_n_m: 3"),
    ],
)
def test_a_value_in_another_unit_is_named(tmp_path: Path, table: str, key: str, value: float, named: str) -> None:
    head, _, rest = FILE.read_text().partition(f"[{table}]\n")
    lines = rest.split("\n")
    row = next(k for k, line in enumerate(lines) if line.startswith(f"{key} ="))
    lines[row] = f"{key} = {value}"
    (tmp_path / "robot.toml").write_text(f"{head}[{table}]\n" + "\n".join(lines))
    assert named in " ".join(robot_doubts(load_robot(tmp_path / "robot.toml")))
