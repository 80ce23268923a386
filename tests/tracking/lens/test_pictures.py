"""Frames of a video of the board serve as its pictures."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.video.writer import VideoWriter
from tests.tracking.lens.conftest import CHARUCO, LENS
from tracking.lens import calibrate_lens, video_pictures


def test_a_video_of_the_board_gives_the_lens(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    with VideoWriter(tmp_path / "board.mp4", 960, 540, fps=30.0, crf=18) as video:
        for picture in pictures[:9]:
            for _ in range(2):
                video.write(picture)
    frames = list(video_pictures(tmp_path / "board.mp4", count=9))
    assert len(frames) == 9
    assert frames[0].shape == (540, 960)
    lens = calibrate_lens(frames, CHARUCO).calibration
    assert lens.fx_px == pytest.approx(LENS.fx_px, rel=5e-3)
