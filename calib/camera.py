"""The camera: its lens and its scale, from a printed board. One function a command of `calib camera`.

Example:
    >>> calib.camera.board("board.pdf")                         # print it, film it, lay it on the water
    PosixPath('board.pdf')
    >>> found = calib.camera.lens([f"board_{n}.png" for n in (1, 2, 3, 4)], "camera.toml", progress=False)
    >>> calib.camera.scale("board_on_water.png", camera="camera.toml").camera_height_m is not None
    True
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tracking.board import BoardScale, BoardSpec
    from tracking.lens import LensCalibration

__all__ = ["board", "lens", "scale"]

_PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")


def board(out: str | Path = "board.pdf", description: str | Path | None = None) -> Path:
    """Draw a calibration board to be printed at its true size.

    Args:
        out: the file to write: .pdf, .svg or .png.
        description: a TOML with a table [board]; default: ChArUco, 9 x 6 squares of 30 mm.

    Returns:
        The file.

    Raises:
        InputError: another suffix, or faults of the description.
        ResultsNotWritable: `out` cannot be written.

    Example:
        >>> calib.camera.board("board.svg")
        PosixPath('board.svg')
    """
    from tracking.board import draw_board

    draw_board(Path(out), _board(description))
    return Path(out)


def lens(
    pictures: str | Path | Sequence[str | Path],
    out: str | Path = "camera.toml",
    description: str | Path | None = None,
    *,
    progress: bool = True,
) -> LensCalibration:
    """Calibrate the lens from pictures of a board at many angles; a session names the file as its calibration.

    Args:
        pictures: 15 to 30 pictures of the board, or one video of it.
        out: the camera file to write.
        description: description of the board, as for `board`.
        progress: show the progress on standard error.

    Returns:
        The camera, its error `rms_px` (px), the share of the picture covered, and flags.

    Raises:
        InputError: pictures that cannot be read, or differ in size.
        NotEnoughData: the board is found in fewer than three of them.
        ResultsNotWritable: `out` cannot be written.

    Source:
        Zhang (2000), "A flexible new technique for camera calibration".

    Example:
        >>> found = calib.camera.lens([f"board_{n}.png" for n in (1, 2, 3, 4)], progress=False)
        >>> found.rms_px < 0.5
        True
    """
    from calib.progress_bar import progress_bar
    from tracking.board import video_pictures
    from tracking.lens import calibrate_lens, save_camera

    files = [Path(file) for file in ([pictures] if isinstance(pictures, str | Path) else pictures)]
    with progress_bar(not progress) as report:
        report("looking for the board", None)
        of_video = len(files) == 1 and files[0].suffix.lower() not in _PICTURES
        found = calibrate_lens(video_pictures(files[0]) if of_video else files, _board(description))
    save_camera(Path(out), found.calibration)
    return found


def scale(
    picture: str | Path,
    description: str | Path | None = None,
    camera: str | Path | None = None,
    board_height_m: float = 0.0,
) -> BoardScale:
    """Measure metres per pixel at the water's surface from a board that lies level.

    With a lens also the camera's height.

    Args:
        picture: a picture of the board.
        description: description of the board, as for `board`.
        camera: the camera file of `lens`; default: no distortion.
        board_height_m: height of the board above the water, m; negative under water.

    Returns:
        The scale and its standard deviation in m per px, the camera's height in m and tilt in degrees.

    Raises:
        InputError: a file cannot be read.
        NotEnoughData: no board is found, or it lies off the surface and the lens is not calibrated.

    Example:
        >>> round(calib.camera.scale("board_on_water.png").metres_per_px, 5)
        0.00112
    """
    from swimcal.session_file import load_camera
    from tracking.board import scale_from_board

    calibration = None if camera is None else load_camera(Path(camera))
    return scale_from_board(Path(picture), _board(description), calibration, board_height_m)


def _board(description: str | Path | None) -> BoardSpec:
    from tracking.board import BoardSpec, load_board

    return BoardSpec(columns=9, rows=6, square_m=0.03) if description is None else load_board(Path(description))
