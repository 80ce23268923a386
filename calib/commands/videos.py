"""Commands about videos and tracks: `track`, `edit`, `view`, `convert`."""

import json
from pathlib import Path
from typing import Annotated

import typer

import calib
from calib.commands.arguments import FORMS, AsJson, Rename, SessionFolder, TrackerOption, Workers, renaming
from calib.terminal import print_export

TRACKER_HELP = "hybrid: spots, and CSRT where none answers; spots: without CSRT; csrt: plain CSRT, the baseline"


def track(
    session: SessionFolder,
    method: Annotated[
        TrackerOption | None, typer.Option(help=f"{TRACKER_HELP}; default: that of the existing tracks, else hybrid")
    ] = None,
    click: Annotated[
        bool, typer.Option("--click", help="only write a page on which to click the start boxes of each video")
    ] = False,
    frame: Annotated[
        int | None, typer.Option(min=0, help="with --click: the frame that the pages show, the first is 0")
    ] = None,
    export: Annotated[str, typer.Option(help=f"also write the tracks as one of: {', '.join(FORMS)}")] = "",
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Track the markers in a session's videos, with the state and confidence of each sample, and flags."""
    from calib.results.tracks import TrackResult
    from calib.tracked_videos import print_tracks

    found = calib.track(
        session, method=method, export=export, click=click, frame=frame, workers=workers, progress=not as_json
    )
    if isinstance(found, TrackResult):
        print_tracks(found, as_json)
    else:
        files = {page.name.removesuffix(".click.html"): str(page) for page in found.files}
        print(json.dumps(files, indent=1) if as_json else "\n".join(files.values()))


def edit(
    session: SessionFolder,
    trial: Annotated[str, typer.Argument(help="the trial to correct")],
    correction: Annotated[
        str,
        typer.Argument(
            help='as JSON, e.g. {"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [120, 180]}; '
            'others: "drop", "relabel", "box" (set a box and track on), "undo"'
        ),
    ],
) -> None:
    """Add a correction to the edit log of a trial; `calib track` replays it. Nothing is ever removed from the log."""
    print(calib.correct(session, trial, correction))


def view(
    session: SessionFolder,
    show: Annotated[bool, typer.Option("--open", help="open it in the Rerun viewer")] = False,
) -> None:
    """Write the rerun recording: video, tracks, states, confidence and, once there is a fit, the twin."""
    from calib.stages.recording import open_viewer

    made = calib.view(session)
    print_export(made)  # print first: the viewer may be missing
    if show:
        open_viewer(made.file)


def convert(
    tracks: Annotated[Path, typer.Argument(help="tracks in any of the forms; recognised from the content")],
    out: Annotated[Path, typer.Option(help="the file to write")],
    to: Annotated[str, typer.Option(help=f"the form to write: {', '.join(FORMS)}")] = "swimcal",
    markers: Annotated[
        str | None,
        typer.Option(
            help="markers to take, comma-separated; in files without a header, their order; default: the published nine"
        ),
    ] = None,
    fps: Annotated[float | None, typer.Option(help="frames a second, for forms without time")] = None,
    rename: Rename = "",
) -> None:
    """Convert tracks between this program, DeepLabCut, movement and the authors' CSV."""
    names = () if markers is None else tuple(name.strip() for name in markers.split(","))
    print(calib.convert_tracks(tracks, out, to, markers=names, fps=fps, rename=renaming(rename)))
