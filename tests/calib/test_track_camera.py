"""`calib camera board`, `lens` and `scale`: a board is drawn, filmed, and gives the lens and the scale."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.video.writer import VideoWriter
from swimcal.session_file import load_camera
from tests.calib.door import Front, assert_reports, edit
from tests.tracking.lens.render import Scene, lens_of, poses
from tracking.board import BoardSpec, read_picture
from tracking.lens import save_camera

LENS = lens_of((640, 360), (380.0, 382.0), (327.0, 176.0), -0.2, 0.06, 0.0, 0.0, 0.0)
BOARD = BoardSpec(columns=9, rows=6, square_m=0.03)
"""The one that `calib camera board` draws."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(LENS, BOARD)


@pytest.fixture(scope="module")
def pictures(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Twelve pictures of the board."""
    folder, rng = tmp_path_factory.mktemp("board"), np.random.default_rng(1)
    for number, pose in enumerate(poses(scene, 12, rng)):
        cv2.imwrite(str(folder / f"{number:02d}.png"), scene.picture(pose[:3], pose[3:], rng))
    return sorted(folder.iterdir())


@pytest.fixture(scope="module")
def film(pictures: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as a video."""
    path = tmp_path_factory.mktemp("film") / "board.mp4"
    with VideoWriter(path, LENS.width_px, LENS.height_px, fps=10.0, crf=16) as writer:
        for picture in pictures:
            writer.write(read_picture(picture))
    return path


def test_a_video_of_the_board_gives_the_lens(calib: Front, tmp_path: Path, film: Path) -> None:
    out = tmp_path / "camera.toml"
    outcome = calib("camera", "lens", film, "--out", out)

    assert outcome.code == 0, outcome.err
    assert "12 of 12 pictures used" in outcome.out
    assert outcome.out.splitlines()[-1] == str(out)
    assert load_camera(out).fx_px == pytest.approx(LENS.fx_px, rel=0.01)


def test_the_lens_as_json_is_all_there_is_on_standard_output(
    calib: Front, tmp_path: Path, pictures: list[Path]
) -> None:
    outcome = calib("camera", "lens", *pictures, "--out", tmp_path / "camera.toml", "--json")

    reported = json.loads(outcome.out)
    assert outcome.err == ""
    assert reported["camera"]["fx_px"] == load_camera(tmp_path / "camera.toml").fx_px
    assert reported["camera"]["fx_px"] == pytest.approx(LENS.fx_px, rel=0.01)
    assert set(reported) == {"camera", "rms_px", "coverage", "flags"}


def test_a_session_takes_the_camera_file(calib: Front, tracked: Path, film: Path) -> None:
    assert calib("camera", "lens", film, "--out", tracked / "camera.toml").code == 0
    edit(tracked / "session.toml", "fps = 30.0", 'fps = 30.0\ncalibration = "camera.toml"')

    out = calib("track", tracked).out
    assert "calibrated for pictures of 640 x 360, the video has 560 x 280" in out
    assert "the lens is not calibrated" not in out


@pytest.mark.parametrize("name", ["board.png", "board.mp4"])
def test_what_is_not_there_is_reported(calib: Front, tmp_path: Path, name: str) -> None:
    assert_reports(calib("camera", "lens", tmp_path / name, "--out", tmp_path / "camera.toml"), str(tmp_path / name))
    assert_reports(calib("camera", "scale", tmp_path / "a.png"), str(tmp_path / "a.png"))
    assert list(tmp_path.iterdir()) == []


def test_a_level_board_gives_the_scale_and_with_a_lens_the_height(calib: Front, tmp_path: Path, scene: Scene) -> None:
    height_m = 0.55
    middle = np.array([*BOARD.size_m, 0.0]) / 2
    picture = scene.picture(np.zeros(3), np.array([0.0, 0.0, height_m]) - middle, np.random.default_rng(0))
    cv2.imwrite(str(tmp_path / "level.png"), picture)
    save_camera(tmp_path / "camera.toml", LENS)
    outcome = calib("camera", "scale", tmp_path / "level.png", "--camera", tmp_path / "camera.toml")

    assert outcome.code == 0, outcome.err
    assert float(outcome.out.split()[0]) == pytest.approx(1000 * height_m / LENS.fx_px, rel=2e-3)
    assert "camera 0.55" in outcome.out
    bare = calib("camera", "scale", tmp_path / "level.png")
    assert bare.code == 0
    assert "camera" not in bare.out


def test_a_board_off_the_surface_needs_a_lens(calib: Front, pictures: list[Path]) -> None:
    assert_reports(calib("camera", "scale", pictures[0], "--board-height-m", "0.1"), "calibrate the lens")


def test_another_board_than_described_is_reported(calib: Front, tmp_path: Path, pictures: list[Path]) -> None:
    (tmp_path / "board.toml").write_text('[board]\nkind = "chessboard"\ncolumns = 12\nrows = 5\nsquare_m = 0.03\n')
    outcome = calib("camera", "lens", *pictures[:4], "--description", tmp_path / "board.toml")

    assert_reports(outcome, "0 of 4 pictures", "chessboard board of 12 x 5 squares")


def test_a_board_is_drawn(calib: Front, tmp_path: Path) -> None:
    out = tmp_path / "board.pdf"
    assert calib("camera", "board", "--out", out)[:2] == (0, f"{out}\n")
    assert out.stat().st_size > 1000
