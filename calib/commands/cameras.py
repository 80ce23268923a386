"""Commands about the camera: `camera board`, `camera lens`, `camera scale`."""

import json
from pathlib import Path
from typing import Annotated

import typer

import calib
from calib.commands.arguments import AsJson

BoardFile = Annotated[
    Path | None, typer.Option(help="TOML with a table [board]; default: the board that `calib camera board` draws")
]


def board(
    out: Annotated[Path, typer.Option(help="the file to write: .pdf, .svg or .png")] = Path("board.pdf"),
    description: BoardFile = None,
) -> None:
    """Draw a calibration board to be printed at its true size."""
    print(calib.camera.board(out, description))


def lens(
    pictures: Annotated[list[Path], typer.Argument(help="15 to 30 pictures of the board, or one video of it")],
    out: Annotated[Path, typer.Option(help="the camera file to write")] = Path("camera.toml"),
    description: BoardFile = None,
    as_json: AsJson = False,
) -> None:
    """Calibrate the lens from pictures of a board at many angles; the session names the file as its calibration."""
    found = calib.camera.lens(pictures, out, description, progress=not as_json)
    if as_json:
        flags = [flag.to_json() for flag in found.flags]
        numbers = {"rms_px": found.rms_px, "coverage": found.coverage}
        print(json.dumps({"camera": found.calibration.model_dump(mode="json"), **numbers, "flags": flags}, indent=1))
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
    board_height_m: Annotated[float, typer.Option(help="height of the board above the water, m")] = 0.0,
) -> None:
    """Measure metres per pixel from a board in the pool; with a lens also the camera's height."""
    found = calib.camera.scale(picture, description, camera, board_height_m)
    print(f"{1000 * found.metres_per_px:.4f} ± {1000 * found.sd_metres_per_px:.4f} mm per pixel at the water's surface")
    if found.camera_height_m is not None:
        height, tilt = found.camera_height_m, found.tilt_deg
        print(f"camera {height:.3f} m above the water (height_above_water_m), tilted by {tilt:.1f} degrees")
    print("scale_length_m of the session: this times the nose-neck distance in pixels")
