from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pytest
from pydantic import Field, field_validator

from swimcal.errors import InputError
from swimcal.robot import load_robot
from swimcal.toml import TomlTable, key_error, lines_of_keys, load_toml

TEXT = '''\
# a comment
title = "x"
[water]
density = 1000.0
"odd key" = """
[not.a.table]
fake = 1
"""
list = [
  1, # one
  [2, 3],
]

[[part]]
name = "a"
deep.er = { in = 1 }
[[part.bolt]]
size = 3
[[part]]
name = "b"
[[part.bolt]]
size = 4
[[part.bolt]]
size = 5
[part.cover]
colour = "red"
'''


def test_every_key_has_the_line_of_its_statement() -> None:
    lines = lines_of_keys(TEXT)
    expected = {
        ("title",): 2,
        ("water",): 3,
        ("water", "density"): 4,
        ("water", "odd key"): 5,
        ("water", "list", 1, 1): 9,
        ("part", 0): 14,
        ("part", 0, "deep", "er", "in"): 16,
        ("part", 0, "bolt", 0, "size"): 18,
        ("part", 1): 19,
        ("part", 1, "bolt", 0, "size"): 22,
        ("part", 1, "bolt", 1, "size"): 24,
        ("part", 1, "cover", "colour"): 26,
    }
    assert {key: lines.get(key) for key in expected} == expected
    assert ("water", "fake") not in lines


class Hinge(TomlTable):
    stiffness: Annotated[float, Field(gt=0)]
    side: Literal["left", "right"] = "left"
    offset: tuple[float, float] = (0.0, 0.0)

    @field_validator("offset")
    @classmethod
    def _near(cls, offset: tuple[float, float]) -> tuple[float, float]:
        if offset[0] > 1:
            raise key_error("too far out", expected="at most 1 m", next_step="Give metres.")
        return offset


class Robot(TomlTable):
    name: str
    hinge: tuple[Hinge, ...]
    spare: Hinge | None = None

    @field_validator("name")
    @classmethod
    def _plain(cls, name: str) -> str:
        if " " in name:
            raise ValueError("no spaces, please")
        return name


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "robot.toml"
    path.write_text(text)
    return path


def test_a_valid_file_becomes_the_model(tmp_path: Path) -> None:
    path = written(tmp_path, 'name = "fish"\n[[hinge]]\nstiffness = 1\noffset = [0.5, 0]\n')
    robot = load_toml(path, Robot)
    assert robot.hinge[0] == Hinge(stiffness=1.0, offset=(0.5, 0.0))
    assert hash(robot) == hash(load_toml(path, Robot))


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("name = 3\nhinge = []", ["line 1, name: wrong value; found 3; expected a valid string"]),
        ('name = "a b"\nhinge = []', ["line 1, name: no spaces, please; found 'a b'"]),
        ('name = "a"', ["hinge: key is missing; expected a list"]),
        (
            'name = "a"\n[[hinge]]\n[[hinge]]\nstifness = 1\nside = "rigth"',
            [
                "line 2, hinge[0].stiffness: key is missing; expected a number",
                "line 3, hinge[1].stiffness: key is missing",
                "line 4, hinge[1].stifness: unknown key; found 'stifness'; expected a known key; "
                "choices: stiffness, side, offset. Did you mean 'stiffness'?",
                "line 5, hinge[1].side: wrong value; found 'rigth'; expected one of the choices; "
                "choices: left, right. Did you mean 'right'?",
            ],
        ),
        (
            'name = "a"\nhinge = []\n[spare]\nstiffness = -1\noffset = [2, 0]',
            [
                "line 4, spare.stiffness: wrong value; found -1; expected greater than 0",
                "line 5, spare.offset: too far out; found [2, 0]; expected at most 1 m. Give metres.",
            ],
        ),
        ('name = "a"\nhinge = []\n[spare]\nstiffness = true', ["found true; expected a valid number"]),
        ('name = "a"\nhinge = []\n[spare]\nstiffness = inf', ["found inf; expected a finite number"]),
        ('name = "a"\nhinge = []\n[spare]\nstiffness = "1"', ["found '1'; expected a valid number"]),
        ('name = "a"\nname = "b"', ["line 2: not valid TOML; found cannot overwrite a value"]),
        ("name = [1,", ["line 1: not valid TOML"]),
        ("name = " + "[" * 9000, ["nested too deeply"]),
        ("name = " + "9" * 5000, ["not valid TOML; found exceeds the limit"]),
    ],
)
def test_faults_are_reported_with_line_key_found_expected_and_choices(
    tmp_path: Path, text: str, messages: list[str]
) -> None:
    with pytest.raises(InputError) as caught:
        load_toml(written(tmp_path, text), Robot)
    for message in messages:
        assert message in str(caught.value)
    assert len(caught.value.faults) >= len(messages)


def test_a_robot_equals_itself_read_twice_whatever_was_computed_of_it() -> None:
    one, other = load_robot(), load_robot()
    assert len(one.segment_x_m) > 1  # an array, kept with the table
    assert len(other.segment_x_m) > 1
    assert one == other
    assert one != other.model_copy(update={"name": "another"})


def test_what_was_computed_of_a_table_is_computed_anew_of_its_copy() -> None:
    robot = load_robot()
    before_kg = robot.tail_mass_kg
    np.testing.assert_allclose(robot.with_tail_mass_times(2.0).tail_mass_kg, 2 * before_kg)
    longer = robot.model_copy(update={"tail": robot.tail.model_copy(update={"start_m": robot.tail.start_m + 0.01})})
    np.testing.assert_allclose(longer.hinge_x_m, robot.hinge_x_m + 0.01)
