from pathlib import Path

import numpy as np
import pytest

from swimcal.errors import InputError
from swimcal.motor_log import COMMAND_COLUMNS, MOTOR_COLUMNS, load_commands
from swimcal.session import file_hashes, load_session
from tests.swimcal.sample import SESSION_TOML, make_session

HEADER = ",".join(COMMAND_COLUMNS)
ROWS = "10.0,rest,0\n10.5,start_code,1.57\n10.75,start_code,-1.57\n11.0,rest,0\n11.5,drive,6.28\n14.5,rest,0\n"
LOG = ",".join(MOTOR_COLUMNS) + "\n" + "10.0,0,0,0,12,30,0\n10.1,0,0,0,12,30,0\n"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "m.commands.csv"
    path.write_text(text)
    return path


def with_log(folder: Path, name: str, commands: str | None) -> Path:
    make_session(folder, SESSION_TOML.replace('"slow.csv"\n', f'"slow.csv"\nmotor = "{name}"\n'))
    (folder / name).write_text(LOG)
    if commands is not None:
        (folder / "slow.commands.csv").write_text(commands)
    return folder


def test_commands_are_read_with_the_stretch_of_each_part(tmp_path: Path) -> None:
    commands = load_commands(written(tmp_path, f"{HEADER}\n{ROWS}"))
    np.testing.assert_array_equal(commands.velocity_rad_s, [0, 1.57, -1.57, 0, 6.28, 0])
    assert commands.part[:2] == ("rest", "start_code")
    assert commands.span_s("start_code") == (10.5, 11.0)
    assert commands.span_s("drive") == (11.5, 14.5)
    assert commands.span_s("end_code") is None


def test_every_fault_is_reported_at_once_with_its_place(tmp_path: Path) -> None:
    text = f"{HEADER}\n1.0,rest,0\n2.0,drve,6\nsoon,drive,6\n3.0,drive\n4.0,rest,0\n"
    with pytest.raises(InputError) as caught:
        load_commands(written(tmp_path, text))
    message = str(caught.value)
    assert "line 3, column 2 (part): unknown part; found 'drve'" in message
    assert "Did you mean 'drive'?" in message
    assert "line 4, column 1 (time_s): not a number; found 'soon'" in message
    assert "line 5: wrong number of columns; found 2 columns" in message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (f"{HEADER}\n", "too short; found no rows"),
        (f"{HEADER}\n1,rest,\n", "line 2, column 3 (velocity_rad_s): the speed is missing"),
    ],
)
def test_faulty_files_are_reported(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        load_commands(written(tmp_path, text))
    assert expected in str(caught.value)


def test_commands_next_to_a_log_are_found_and_counted_among_the_inputs(tmp_path: Path) -> None:
    session = load_session(with_log(tmp_path / "pool", "slow.motor.csv", f"{HEADER}\n{ROWS}"))
    assert session.trial("slow").commands == session.folder / "slow.commands.csv"
    assert session.trial("fast").commands is None
    assert "slow.commands.csv" in file_hashes(session)
