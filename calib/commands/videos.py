"""Commands that work on a session's videos: `track`, `edit`, `view`."""

import json
import shutil
import subprocess
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import typer

from calib.commands.arguments import AsJson, SessionFolder, Workers
from calib.options import Options
from calib.pipeline import Pipeline
from calib.working import working
from session import FaultCollector, Session, TrialSpec
from tracking.records import FORMATS, EditLog, SampleState, export_tracks
from tracking.tracker import TrackerName

TRACKER_HELP = "hybrid: spots, and CSRT where none answers; spots: without CSRT; csrt: plain CSRT, the baseline"
_SUFFIX = {"swimcal": ".csv", "deeplabcut": ".dlc.csv", "fishsim": ".fishsim.csv"}


def track(
    session: SessionFolder,
    method: Annotated[
        TrackerName | None, typer.Option(help=f"{TRACKER_HELP}; default: that of the tracks which stand, else hybrid")
    ] = None,
    click: Annotated[
        bool, typer.Option("--click", help="only write a page on which to click the start boxes of each video")
    ] = False,
    export: Annotated[str, typer.Option(help=f"also write the tracks as one of: {', '.join(FORMATS)}")] = "",
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Tracks the markers in a session's videos, with the state and confidence of each sample, and flags."""
    with working(session, as_json, Options(workers=workers, tracker=method)) as pipeline:
        filmed = _filmed(pipeline.session)
        videos = pipeline.recordings.videos
        if export:
            _check_format(export)
        if click:
            for page in [videos.click_page(spec) for spec in filmed]:
                print(page)
            return
        boxes = videos.all_boxes(filmed)
        lines = {spec.name: _tracked(pipeline, spec, export) for spec in filmed}
    if as_json:
        print(
            json.dumps(
                {name: line.to_json() | {"boxes": boxes[name].to_json()} for name, line in lines.items()}, indent=1
            )
        )
        return
    print(f"{'trial':12} {'frames':>7} {'seen':>7} {'filled':>7} {'missing':>8} {'confidence':>11}  flags")
    for name, line in lines.items():
        print(f"{name:12} {line.text()}")
    print(videos.folder)


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
    """Adds a correction to the edit log of a trial; `calib track` replays it. Nothing is ever removed from the log."""
    from calib.pipeline import open_session

    spec = open_session(session).trial(trial)
    log = _log(open_session(session), spec).append_text(correction)
    print(f"{log.path}: {len(log.in_force)} edits count")


def view(
    session: SessionFolder,
    show: Annotated[bool, typer.Option("--open", help="open it in the Rerun viewer")] = False,
    workers: Workers = 0,
) -> None:
    """Writes the rerun recording: video, tracks, states, confidence and, once there is a fit, the twin beside them."""
    from calib.viewing import make_recording

    with working(session, False, Options(workers=workers)) as pipeline:
        recording = make_recording(pipeline)
    print(recording)
    if show:
        viewer = shutil.which("rerun")
        subprocess.Popen([viewer or "rerun", str(recording)], start_new_session=True)


def _filmed(session: Session) -> list[TrialSpec]:
    """The trials to be tracked: those with a video and no tracks of their own.

    Raises:
        InputError: there is none.
    """
    filmed = [spec for spec in session.trials if spec.video is not None and spec.tracks is None]
    if not filmed:
        faults = FaultCollector(str(session.folder / "session.toml"))
        faults.add("", "no video to track", found=f"{len(session.trials)} trials", expected='a trial with video = "…"')
        faults.raise_if_any()
    return filmed


def _check_format(name: str) -> None:
    faults = FaultCollector("--export")
    if name not in FORMATS:
        faults.add("", "no such form of tracks", found=repr(name), choices=tuple(FORMATS))
    faults.raise_if_any()


def _log(session: Session, spec: TrialSpec) -> EditLog:
    if spec.edits is None:
        faults = FaultCollector(str(session.folder / "session.toml"))
        faults.add(f"trial {spec.name}", "it has no video", expected="a trial whose video is tracked here")
        faults.raise_if_any()
    assert spec.edits is not None
    return EditLog.load(spec.edits, session.markers)


@dataclass(frozen=True)
class TrackLine:
    """What is said of one tracked video: shares of its samples from the frame of the boxes on."""

    frames: int
    seen: float
    filled: float
    missing: float
    confidence: float
    flags: dict[str, int]
    tracks: str

    def text(self) -> str:
        """For a terminal."""
        flags = ", ".join(f"{count} {kind}" for kind, count in self.flags.items()) or "none"
        shares = f"{self.seen:7.2%} {self.filled:7.2%} {self.missing:8.2%}"
        return f"{self.frames:7d} {shares} {self.confidence:11.2f}  {flags}"

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)


def _tracked(pipeline: Pipeline, spec: TrialSpec, export: str) -> TrackLine:
    """Tracks one trial, writes it in another form if asked to."""
    videos = pipeline.recordings.videos
    found = videos.tracks(spec)
    tracked = found.tracked
    if export:
        export_tracks(tracked, videos.folder / f"{spec.name}{_SUFFIX.get(export, '.nc')}", export)
    since = slice(found.boxes.frame, None)
    seen, present = tracked.seen[since], tracked.state[since] != SampleState.MISSING
    return TrackLine(
        frames=len(tracked.state),
        seen=float(seen.mean()),
        filled=float((present & ~seen).mean()),
        missing=float((~present).mean()),
        confidence=float(tracked.tracks.confidence[since][seen].mean()),
        flags=dict(Counter(flag.kind for flag in found.flags)),
        tracks=str(videos.folder / f"{spec.name}.csv"),
    )
