"""A printed board is the board that is looked for, at its true size."""

import re
from pathlib import Path

import numpy as np
import pytest

from swimcal.errors import InputError
from tracking.board import BoardSpec, draw_board, find_corners, read_picture

BOARD = BoardSpec(columns=6, rows=4, square_m=0.03)


@pytest.mark.parametrize("kind", ["charuco", "chessboard"])
def test_every_corner_of_a_drawn_board_is_found_at_its_true_size(kind: str, tmp_path: Path) -> None:
    board = BOARD.model_copy(update={"kind": kind})
    draw_board(tmp_path / "board.png", board)
    seen = find_corners(read_picture(tmp_path / "board.png"), board)
    assert len(seen.image_px) == 15
    mm = seen.image_px / 300 * 25.4
    apart = np.linalg.norm(mm[:, None] - mm[None], axis=-1)
    true = 1e3 * np.linalg.norm(seen.place_m[:, None] - seen.place_m[None], axis=-1)
    assert apart == pytest.approx(true, abs=0.1)


def test_drawings_have_the_size_of_the_paper(tmp_path: Path) -> None:
    draw_board(tmp_path / "board.svg", BOARD)
    draw_board(tmp_path / "board.pdf", BOARD)
    points = 72 / 25.4
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', (tmp_path / "board.svg").read_text())
    assert size
    assert float(size[1]) == pytest.approx((6 * 30 + 60) * points, rel=1e-4)
    assert float(size[2]) == pytest.approx((4 * 30 + 60 + 15) * points, rel=1e-4)
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")


def test_another_kind_of_file_is_refused_with_the_choices(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"found \.docx; choices: \.pdf, \.svg, \.png"):
        draw_board(tmp_path / "board.docx", BOARD)
    assert not list(tmp_path.iterdir())
