"""The built-in robot and two made-up ones, which need nothing but their TOML."""

from pathlib import Path

import pytest

from swimcal.robot import RobotSpec, load_robot

FOLDER = Path(__file__).parent
FISH = load_robot()
THREE_LINK = load_robot(FOLDER / "three_link.toml")
SEVEN_LINK = load_robot(FOLDER / "seven_link.toml")

every_robot = pytest.mark.parametrize("robot", [FISH, THREE_LINK, SEVEN_LINK], ids=lambda robot: robot.name)


def changed(robot: RobotSpec, **tables: dict[str, object]) -> RobotSpec:
    """The robot with some keys of some tables changed, validated anew."""
    content = robot.model_dump()
    for table, keys in tables.items():
        content[table] |= keys
    return RobotSpec.model_validate(content)
