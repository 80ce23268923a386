"""Commands about the camera: `camera board`, `camera lens`, `camera scale`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.commands.arguments import AsJson

if TYPE_CHECKING:
    import numpy as np

    from tracking.lens import BoardSpec

BoardFile = Annotated[
    Path | None, typer.Option(help="TOML with a table [board]; default: the board that `calib camera board` draws")
]


def board(
    out: Annotated[Path, typer.Option(help="the file to write: .pdf, .svg or .png")] = Path("board.pdf"),
    description: BoardFile = None,
) -> None:
    """Draws a calibration board to be printed at its true size."""
    from tracking.lens import draw_board

    draw_board(out, _board(description))
    print(out)


def lens(
    pictures: Annotated[list[Path], typer.Argument(help="15 to 30 pictures of the board, or one video of it")],
    out: Annotated[Path, typer.Option(help="the camera file to write")] = Path("camera.toml"),
    description: BoardFile = None,
    as_json: AsJson = False,
) -> None:
    """Calibrates the lens from pictures of a board at many angles; the session names the file as its calibration."""
    from calib.progress import progress_bar
    from tracking.lens import calibrate_lens, save_camera

    spec = _board(description)
    with progress_bar(as_json) as report:
        report("looking for the board", None)
        found = calibrate_lens(_pictures(pictures), spec)
    save_camera(out, found.calibration)
    if as_json:
        flags = [flag.to_json() for flag in found.flags]
        camera = found.calibration.model_dump(mode="json")
        numbers = {"rms_px": found.rms_px, "coverage": found.coverage}
        print(json.dumps({"camera": camera, **numbers, "flags": flags}, indent=1))
        return
    used = found.pictures - len(found.rejected)
    covered = f"{found.coverage:.0%} of the picture covered"
    print(f"{used} of {found.pictures} pictures used, {found.rms_px:.2f} px rms, {covered}")
    for flag in found.flags:
        print(f"! {flag.message}")
    print(out)


def scale(
    picture: Annotated[Path, typer.Argument(help="a picture of the board lying level at the water's surface")],
    description: BoardFile = None,
    camera: Annotated[Path | None, typer.Option(help="the camera file of `calib camera lens`")] = None,
    board_height_m: Annotated[float, typer.Option(help="of the board above the water, m")] = 0.0,
) -> None:
    """Metres per pixel from a board in the pool, and by the nose-neck distance; the camera's height with a lens."""
    from session.camera import load_camera
    from tracking.lens import scale_from_board

    found = scale_from_board(picture, _board(description), load_camera(camera) if camera else None, board_height_m)
    print(f"{1000 * found.metres_per_px:.4f} ± {1000 * found.sd_metres_per_px:.4f} mm per pixel at the water's surface")
    if found.camera_height_m is not None:
        height, tilt = found.camera_height_m, found.tilt_deg
        print(f"camera {height:.3f} m above the water (height_above_water_m), tilted by {tilt:.1f} degrees")
    print("scale_length_m of the session: this times the nose-neck distance in pixels")


_PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")


def _board(description: Path | None) -> BoardSpec:
    from tracking.lens import BoardSpec, load_board

    return BoardSpec(columns=9, rows=6, square_m=0.03) if description is None else load_board(description)


def _pictures(files: list[Path]) -> Iterable[Path | np.ndarray]:
    """The pictures, or frames of a single video."""
    from tracking.lens import video_pictures

    return files if len(files) > 1 or files[0].suffix.lower() in _PICTURES else video_pictures(files[0])
