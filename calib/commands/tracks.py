"""The command that brings tracks from one program's form into another's: `convert`."""

from pathlib import Path
from typing import Annotated

import typer

from calib.commands.arguments import FORMS


def convert(
    tracks: Annotated[Path, typer.Argument(help="tracks in any of the forms; which one is told from the content")],
    out: Annotated[Path, typer.Option(help="the file to write")],
    to: Annotated[str, typer.Option(help=f"the form to write: {', '.join(FORMS)}")] = "swimcal",
    markers: Annotated[
        str | None,
        typer.Option(
            help="markers to take, comma-separated; in files without a header, their order; default: the published nine"
        ),
    ] = None,
    fps: Annotated[float, typer.Option(help="frames a second, for forms without time")] = 60.0,
) -> None:
    """Converts tracks between this program, DeepLabCut, movement and the authors' CSV."""
    from calib import interface
    from session.create import FISHSIM_MARKERS

    check_form(to, "--to")
    names = FISHSIM_MARKERS if markers is None else tuple(name.strip() for name in markers.split(","))
    _check_numbers(names, fps, out)
    print(interface.convert_tracks(tracks, out, to, markers=names, fps=fps))


def check_form(name: str, option: str) -> None:
    """Whether tracks can be written in this form.

    Raises:
        InputError: they cannot; lists the forms.
    """
    from session import FaultCollector
    from tracking.records.formats import FORMATS

    faults = FaultCollector(option)
    if name not in FORMATS:
        faults.add("", "no such form of tracks", found=repr(name), choices=FORMATS)
    faults.raise_if_any()


def _check_numbers(names: tuple[str, ...], fps: float, out: Path) -> None:
    from session import FaultCollector

    faults = FaultCollector("the options")
    if not 0 < fps < float("inf"):
        faults.add("--fps", "not a frame rate", found=f"{fps:g}", expected="a number above 0")
    if not all(names) or len(set(names)) < len(names):
        faults.add("--markers", "not a list of markers", found=", ".join(names), expected="each marker once")
    if out.suffix == ".gz":
        faults.add("--out", "packed files are read, not written", found=out.name, expected="a name without .gz")
    faults.raise_if_any()
