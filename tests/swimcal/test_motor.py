from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.errors import InputError
from swimcal.motor_log import COMMAND_COLUMNS, MOTOR_COLUMNS, SPEED_RAD_S, load_commands, load_motor
from swimcal.session import file_hashes, load_session
from tests.swimcal.sample import SESSION_TOML, make_session

HEADER = ",".join(MOTOR_COLUMNS)
ROWS = "10.00,0.1,6.28,0.5,12.0,30,0\n10.01,0.2,6.28,,12.0,30,0\n10.02,0.3,6.28,0.5,12.0,31,32\n"
COMMANDS_HEADER = ",".join(COMMAND_COLUMNS)
COMMANDS = "10.0,rest,0\n10.5,start_code,1.57\n10.75,start_code,-1.57\n11.0,rest,0\n11.5,drive,6.28\n14.5,rest,0\n"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "m.csv"
    path.write_text(text)
    return path


def test_a_velocity_that_is_the_number_of_a_register_does_not_fit_the_position(tmp_path: Path) -> None:
    time_s = np.arange(300) / 100
    rows = [f"{t},{6.0 * t},{6.0 / SPEED_RAD_S},,,," for t in time_s.tolist()]
    path = tmp_path / "f0_95.motor.csv"
    path.write_text("\n".join([",".join(MOTOR_COLUMNS), *rows]) + "\n")
    with pytest.raises(InputError, match=r"position_rad and velocity_rad_s do not fit each other.*0\.02"):
        load_motor(path)


@given(rest_s=st.floats(0.0, 30.0), slow=st.floats(0.0, 0.3), rad_s=st.floats(2.0, 16.0), seed=st.integers(0, 99))
def test_a_log_may_rest_or_turn_slowly_for_most_of_its_time(
    rest_s: float, slow: float, rad_s: float, seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    time_s = np.cumsum(np.random.default_rng(seed).uniform(0.006, 0.014, round((rest_s + 8.0) / 0.01)))
    velocity = np.where(time_s < rest_s, slow * rad_s, rad_s)
    position = np.concatenate([[0.0], np.cumsum(np.diff(time_s) * velocity[1:])])
    rows = [f"{t:.5f},{p:.6f},{v:.5f},,,," for t, p, v in zip(time_s, position, velocity, strict=True)]
    path = tmp_path_factory.mktemp("log") / "f1_00.motor.csv"
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    assert load_motor(path).flags == ()


def test_motor_log_reads_every_column(tmp_path: Path) -> None:
    log = load_motor(written(tmp_path, f"{HEADER}\n{ROWS}"))
    np.testing.assert_array_equal(log.time_s, [10.0, 10.01, 10.02])
    np.testing.assert_array_equal(log.current_a, [0.5, np.nan, 0.5])
    np.testing.assert_array_equal(log.error, [0, 0, 32])
    assert log.flags == ()


@pytest.mark.parametrize(
    "end", ["10.03,0.4,6.2", "10", "10.03,0.4,6.28,0.5,12.0,31,3", "10.03,0.4\n", "10.03,0" + 40 * "\0"]
)
def test_a_last_row_cut_short_is_left_out_and_flagged(tmp_path: Path, end: str) -> None:
    log = load_motor(written(tmp_path, f"{HEADER}\n{ROWS}{end}"))
    assert len(log.time_s) == 3
    assert [flag.kind for flag in log.flags] == ["truncated_log"]
    assert "line 5" in log.flags[0].message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ROWS, f"line 1: no header; expected {HEADER}"),
        (HEADER.replace("current_a", "curent_a") + "\n" + ROWS, "wrong header; found time_s,"),
        (HEADER.replace("current_a", "curent_a") + "\n" + ROWS, "Did you mean 'current_a'?"),
        (f"{HEADER}\n{ROWS}10.01,1,1,1,1,1,0\n", "line 5: time does not increase; found 10.01 after 10.02"),
        (
            f"{HEADER}\n10.0,1,1\n{ROWS}",
            "line 2: wrong number of columns; found 3 columns",
        ),
        (
            f"{HEADER}\n{ROWS}11,fast,1,1,1,1,0\n",
            "line 5, column 2 (position_rad): not a number",
        ),
        (f"{HEADER}\n", "too short; found 0 rows; expected at least 2"),
    ],
)
def test_faulty_motor_logs_are_reported_with_their_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_motor(written(tmp_path, text))
    assert message in str(caught.value)


def test_commands_are_read_with_the_stretch_of_each_part(tmp_path: Path) -> None:
    commands = load_commands(written(tmp_path, f"{COMMANDS_HEADER}\n{COMMANDS}"))
    np.testing.assert_array_equal(commands.velocity_rad_s, [0, 1.57, -1.57, 0, 6.28, 0])
    assert commands.part[:2] == ("rest", "start_code")
    assert commands.span_s("start_code") == (10.5, 11.0)
    assert commands.span_s("drive") == (11.5, 14.5)
    assert commands.span_s("end_code") is None


def test_every_fault_of_commands_is_reported_at_once_with_its_place(tmp_path: Path) -> None:
    text = f"{COMMANDS_HEADER}\n1.0,rest,0\n2.0,drve,6\nsoon,drive,6\n3.0,drive\n4.0,rest,0\n"
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
        (f"{COMMANDS_HEADER}\n", "too short; found no rows"),
        (f"{COMMANDS_HEADER}\n1,rest,\n", "line 2, column 3 (velocity_rad_s): the speed is missing"),
    ],
)
def test_faulty_commands_are_reported(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        load_commands(written(tmp_path, text))
    assert expected in str(caught.value)


def test_commands_next_to_a_log_are_found_and_counted_among_the_inputs(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "s", SESSION_TOML.replace('"slow.csv"', '"slow.csv"\nmotor = "slow.motor.csv"'))
    (folder / "slow.motor.csv").write_text(f"{HEADER}\n{ROWS}")
    (folder / "slow.commands.csv").write_text(f"{COMMANDS_HEADER}\n{COMMANDS}")
    session = load_session(folder)
    assert session.trial("slow").commands == session.folder / "slow.commands.csv"
    assert session.trial("fast").commands is None
    assert "slow.commands.csv" in file_hashes(session)
