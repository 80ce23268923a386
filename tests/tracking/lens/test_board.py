"""A board is checked when it is described."""

from pathlib import Path

import pytest

from swimcal.errors import InputError
from tracking.board import load_board


def test_a_board_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "board.toml").write_text("[board]\ncolumns = 9\nrows = 6\nsquare_m = 0.04\n")
    board = load_board(tmp_path / "board.toml")
    assert board.size_m == pytest.approx((0.36, 0.24))
    assert board.marker_side_m == pytest.approx(0.028)
    assert board.corner_places_m[0] == pytest.approx([0.04, 0.04, 0])
    assert len(board.corner_places_m) == 40


def test_all_faults_of_a_board_file_are_named_at_once(tmp_path: Path) -> None:
    text = '[board]\ncolumns = 9\nrows = 6\nsquare_m = 0.04\nmarker_m = 0.05\ndictionary = "DICT_5X5_25"\nsize = 3\n'
    (tmp_path / "board.toml").write_text(text)
    with pytest.raises(InputError) as error:
        load_board(tmp_path / "board.toml")
    message = str(error.value)
    assert "line 5, board.marker_m: the marker does not fit its square" in message
    assert "less than square_m = 0.04" in message
    assert "Did you mean 'DICT_5X5_250'?" in message
    assert "unknown key; found 'size'" in message


def test_a_dictionary_must_have_a_marker_for_each_white_square(tmp_path: Path) -> None:
    text = '[board]\ncolumns = 12\nrows = 10\nsquare_m = 0.04\ndictionary = "DICT_5X5_50"\n'
    (tmp_path / "board.toml").write_text(text)
    with pytest.raises(InputError, match="too few markers; found DICT_5X5_50: 50; expected at least 60"):
        load_board(tmp_path / "board.toml")
