"""A known lens comes back from rendered pictures of a board, and doubtful calibrations say so."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.video.writer import VideoWriter
from swimcal.errors import InputError, NotEnoughData
from tests.tracking.lens.conftest import CHARUCO, LENS
from tests.tracking.lens.render import Scene, poses, to_pixels
from tracking.board import BoardSpec, find_corners, video_pictures
from tracking.camera import to_rays
from tracking.lens import LensCalibration, calibrate_lens


@pytest.fixture(scope="module")
def calibrated(pictures: list[np.ndarray]) -> LensCalibration:
    return calibrate_lens(pictures, CHARUCO)


def all_over_the_picture() -> np.ndarray:
    x, y = np.linspace(0, LENS.width_px - 1, 25), np.linspace(0, LENS.height_px - 1, 15)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def worst_bend_px(calibrated: LensCalibration) -> float:
    """Over the picture, after the best move, turn and scale of the rays: where a swim has its place and scale from."""
    pixel = all_over_the_picture()
    true, found = to_rays(pixel, LENS), to_rays(pixel, calibrated.calibration)
    a, b = ((rays - rays.mean(axis=0)) @ [1, 1j] for rays in (found, true))
    aligned = a * (np.conj(a) @ b / (np.conj(a) @ a)) + true.mean(axis=0) @ [1, 1j]
    back = to_pixels(np.column_stack([aligned.real, aligned.imag]), LENS)
    return float(np.linalg.norm(back - pixel, axis=1).max())


def test_the_lens_comes_back_all_over_the_picture(calibrated: LensCalibration) -> None:
    assert worst_bend_px(calibrated) < 0.3


def test_the_numbers_are_within_their_standard_deviations(calibrated: LensCalibration) -> None:
    lens, sd = calibrated.calibration, calibrated.sd
    off = [(getattr(lens, key) - getattr(LENS, key)) / getattr(sd, key) for key in ("fx_px", "fy_px", "cx_px", "cy_px")]
    off += list((np.array(lens.distortion) - LENS.distortion) / np.array(sd.distortion))
    assert np.sqrt(np.mean(np.square(off))) < 2
    assert np.abs(off).max() < 4


def test_the_stated_uncertainty_of_the_shape_covers_its_error(calibrated: LensCalibration) -> None:
    assert worst_bend_px(calibrated) < 3 * np.sqrt(2) * calibrated.sd.bend_px
    assert calibrated.sd.bend_px < 0.2


def test_a_good_calibration_has_no_flags(calibrated: LensCalibration) -> None:
    assert calibrated.flags == ()
    assert calibrated.rms_px < 0.1
    assert calibrated.coverage > 0.7
    assert calibrated.rejected == ()


def test_corners_are_found_within_a_tenth_of_a_pixel(scene: Scene, pictures: list[np.ndarray]) -> None:
    rng = np.random.default_rng(1)
    for picture, pose in zip(pictures[:4], poses(scene, 18, rng)[:4], strict=True):
        seen = find_corners(picture, CHARUCO)
        axes = cv2.Rodrigues(pose[:3])[0]
        point = seen.place_m @ axes.T + pose[3:]
        error_px = seen.image_px - to_pixels(point[:, :2] / point[:, 2:], LENS)
        assert np.sqrt((error_px**2).mean()) < 0.05
        assert np.abs(error_px.mean(axis=0)).max() < 0.02


@pytest.mark.long
def test_a_chessboard_gives_the_lens_too() -> None:
    rng = np.random.default_rng(2)
    scene = Scene(LENS, BoardSpec(kind="chessboard", columns=7, rows=6, square_m=0.03))
    views = [scene.picture(pose[:3], pose[3:], rng) for pose in poses(scene, 5, rng, reach=0.1)]
    found = calibrate_lens(views, scene.board)
    assert found.rejected == ()
    assert found.calibration.fx_px == pytest.approx(LENS.fx_px, rel=5e-3)


def test_parallel_views_are_flagged(scene: Scene) -> None:
    rng = np.random.default_rng(3)
    level = [scene.picture(np.array([0.0, 0.0, turn]), np.array([-0.1, -0.08, 0.25]), rng) for turn in (0, 0.1, 0.2)]
    kinds = {flag.kind for flag in calibrate_lens(level, CHARUCO).flags}
    assert {"lens_parallel_views", "lens_few_views"} <= kinds


def test_a_board_kept_in_the_middle_is_flagged(scene: Scene) -> None:
    rng, centre = np.random.default_rng(4), np.array([*CHARUCO.size_m, 0.0]) / 2
    tilts = [np.array([np.cos(a), np.sin(a), 0.0]) * 0.5 for a in np.arange(5)]
    views = [scene.picture(t, [0, 0, 0.45] - cv2.Rodrigues(t)[0] @ centre, rng) for t in tilts]
    assert "lens_coverage" in {flag.kind for flag in calibrate_lens(views, CHARUCO).flags}


def test_pictures_without_a_board_are_named_with_the_reason(pictures: list[np.ndarray]) -> None:
    blank = np.full_like(pictures[0], 128)
    found = calibrate_lens([*pictures[:5], blank], CHARUCO)
    assert found.rejected == ("picture 6: no charuco board was found",)


@pytest.mark.long
def test_a_picture_that_does_not_fit_is_left_out(pictures: list[np.ndarray]) -> None:
    bent = cv2.resize(pictures[4][:, 100:860], (960, 540))
    found = calibrate_lens([*pictures[:6], bent], CHARUCO)
    (reason,) = found.rejected
    assert reason.startswith("picture 7: its corners do not fit the lens")
    assert found.calibration.fx_px == pytest.approx(LENS.fx_px, rel=5e-3)


def test_too_few_boards_say_what_was_looked_for(pictures: list[np.ndarray]) -> None:
    with pytest.raises(NotEnoughData, match=r"found in 2 of 2 pictures; at least 3 .* 8 x 6 squares .* DICT_5X5_250"):
        calibrate_lens(pictures[:2], CHARUCO)


def test_all_unreadable_pictures_are_named_at_once(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    files = [tmp_path / name for name in ("a.png", "b.png", "c.png", "d.png")]
    cv2.imwrite(str(files[0]), pictures[0])
    files[1].write_text("not a picture")
    cv2.imwrite(str(files[3]), pictures[0][:100])
    with pytest.raises(InputError) as error:
        calibrate_lens(files, CHARUCO)
    message = str(error.value)
    assert "b.png: not a picture" in message
    assert "c.png: the picture cannot be read; found No such file" in message
    assert "d.png: a picture of another size; found 960 x 100; expected 960 x 540, like a.png" in message


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
