from pathlib import Path

import numpy as np
import pytest

from swimcal.errors import InputError
from swimcal.motor_log import MOTOR_COLUMNS, load_motor

HEADER = ",".join(MOTOR_COLUMNS)
ROWS = "10.00,0.1,6.28,0.5,12.0,30,0\n10.01,0.2,6.28,,12.0,30,0\n10.02,0.3,6.28,0.5,12.0,31,32\n"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "m.csv"
    path.write_text(text)
    return path


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
