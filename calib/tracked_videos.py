"""Tracking and correcting videos on the command line: what is tracked, what fails, what is told."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

from calib.options import Options
from calib.pipeline import Pipeline
from calib.working import working
from session import CameraSpec, FaultCollector, Flag, InputError, NotEnoughData, Session, TrialSpec
from session.results import plain_json
from swimmer import RobotSpec
from tracking import to_pool
from tracking.lens import lens_flags
from tracking.records import EditLog, SampleState, TrackedTrial, export_tracks
from tracking.tracker import TrackerName
from tracking.video import Video


def camera_doubts(found: Iterable[TrackedTrial], camera: CameraSpec, robot: RobotSpec) -> tuple[Flag, ...]:
    """The doubts about lens, size and height, of each kind the first: the videos share one camera.

    Args:
        found: the tracks of every video.
        camera: of the session.
        robot: whose markers' heights parallax depends on.
    """
    flags: dict[str, Flag] = {}
    for tracks in found:
        scale = _metres_per_px(tracks, camera, robot)
        for flag in lens_flags(camera, picture_px=tracks.picture_px, metres_per_px=scale):
            flags.setdefault(flag.kind, flag)
    return tuple(flags.values())


def _metres_per_px(found: TrackedTrial, camera: CameraSpec, robot: RobotSpec) -> float | None:
    """The scale by the nose-neck distance; None where nose and neck are never seen."""
    tracks = found.counting
    heights_m = robot.marker_positions_m(tracks.markers)[:, 2]
    try:
        return to_pool(tracks, camera, tracks.confidence, heights_m)[1]
    except NotEnoughData:
        return None


T = TypeVar("T")

_SUFFIX = {"swimcal": ".csv", "deeplabcut": ".dlc.csv", "fishsim": ".fishsim.csv"}


def write_click_pages(folder: Path, as_json: bool) -> None:
    """A page a video on which to click its start boxes; tells where they are.

    Raises:
        InputError: no video, or one that cannot be read.
    """
    with working(folder, as_json) as pipeline:
        pages = _each(_filmed(pipeline.session), pipeline.recordings.videos.click_page)
    files = {name: str(page) for name, page in pages.items()}
    print(json.dumps(files, indent=1) if as_json else "\n".join(files.values()))


def track_videos(pipeline: Pipeline, export: str) -> tuple[dict[str, TrackedTrial], list[Path]]:
    """The tracks of every video of a session, up to date, and the files that they were exported to.

    Args:
        pipeline: of the session.
        export: a form of `tracking.records.FORMATS` to write beside them; empty for none.

    Raises:
        InputError: no video; or faults of videos, boxes or edits, after all other videos are tracked.
    """
    filmed, videos, exported = _filmed(pipeline.session), pipeline.recordings.videos, []
    videos.all_boxes(filmed)
    tracks = _each(filmed, videos.tracks)
    if export:
        for name, found in tracks.items():
            exported.append(videos.folder / f"{name}{_SUFFIX.get(export, '.nc')}")
            export_tracks(found, exported[-1], export)
    return tracks, exported


def tell_tracks(session: Path, method: TrackerName | None, export: str, workers: int, as_json: bool) -> None:
    """Tracks the videos of a session and tells what came of each; arguments as of `calib.track`."""
    with working(session, as_json, Options(workers=workers, tracker=method)) as pipeline:
        tracks, exported = track_videos(pipeline, export)
        videos = pipeline.recordings.videos
        boxes = videos.all_boxes(_filmed(pipeline.session))
    doubts = camera_doubts(tracks.values(), pipeline.session.camera, pipeline.robot)
    lines = {name: TrackLine.of(found, videos.folder / f"{name}.csv") for name, found in tracks.items()}
    if as_json:
        camera = {"camera": [flag.to_json() for flag in doubts]}
        flags = {name: [flag.to_json() for flag in found.flags] for name, found in tracks.items()}
        more = {name: {"boxes": boxes[name].to_json(), "flags": flags[name]} | camera for name in lines}
        told = {name: line.to_json() | more[name] for name, line in lines.items()}
        print(json.dumps(plain_json(told), indent=1))
        return
    shares = f"{'seen':>7} {'counts':>7} {'filled':>7} {'missing':>8}"
    print(f"{'trial':12} {'frames':>7} {shares} {'confidence':>11}  flags")
    for name, line in lines.items():
        print(f"{name:12} {line.text()}")
    for name, found in tracks.items():
        whole = [flag for flag in found.flags if flag.frames is None and flag.message]
        print("".join(f"! {name}: {flag.message}\n" for flag in whole), end="")
    print("".join(f"! {flag.message}\n" for flag in doubts), end="")
    print("".join(f"{path}\n" for path in exported), end="")
    print(videos.folder)


def correct_track(session: Path, trial: str, correction: str | Mapping[str, Any]) -> str:
    """Adds a correction, a mapping or JSON, to the edit log of a trial; in a sentence how many count.

    Raises:
        InputError: no such trial, or the correction or the log has faults.
    """
    text = correction if isinstance(correction, str) else json.dumps(correction)
    with working(session, True) as pipeline:
        log = _log(pipeline.session, pipeline.session.trial(trial)).append_text(text)
    edits = "1 edit counts" if len(log.in_force) == 1 else f"{len(log.in_force)} edits count"
    return f"{log.path}: added line {log.edits[-1].line}; {edits}. `calib track` replays them"


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


def _each(specs: Sequence[TrialSpec], make: Callable[[TrialSpec], T]) -> dict[str, T]:
    """What is made of each trial; one that is faulty does not keep the others from it.

    Raises:
        InputError: at the end, with the faults of all.
    """
    made, faults = {}, FaultCollector()
    for spec in specs:
        with faults.nested():
            made[spec.name] = make(spec)
    faults.raise_if_any()
    return made


def _log(session: Session, spec: TrialSpec) -> EditLog:
    """The edit log of a trial, and its number of frames, for edits to be held against.

    Raises:
        InputError: the trial is not tracked from a video, its video cannot be read, or the log has faults.
    """
    if spec.video is None or spec.edits is None or spec.tracks is not None:
        faults = FaultCollector(str(session.folder / "session.toml"))
        what = "it has no video" if spec.video is None else "its tracks come from a file, not from its video"
        choices = [each.name for each in session.trials if each.video is not None and each.tracks is None]
        expected = "a trial whose video is tracked here"
        faults.add(f"trial {spec.name}", what, expected=expected, choices=choices)
        raise InputError(faults.faults)
    with Video(spec.video) as video:
        return EditLog.load(spec.edits, session.markers, video.info.frames)


@dataclass(frozen=True)
class TrackLine:
    """What is said of one tracked video: shares of its samples from the frame of the boxes on.

    Not all that is seen counts in a fit: see `docs/tracking.md`, "States and flags".
    """

    frames: int
    seen: float
    counts: float
    filled: float
    missing: float
    confidence: float
    flags: dict[str, int]
    tracks: str

    @classmethod
    def of(cls, tracked: TrackedTrial, file: Path) -> Self:
        """What is said of these tracks, which stand in `file`."""
        assert tracked.weight is not None
        since = slice(tracked.first_frame, None)
        seen, present = tracked.seen[since], tracked.state[since] != SampleState.MISSING
        return cls(
            frames=len(tracked.state),
            seen=float(seen.mean()),
            counts=float((tracked.weight[since] > 0).mean()),
            filled=float((present & ~seen).mean()),
            missing=float((~present).mean()),
            confidence=float(np.average(tracked.tracks.confidence[since], weights=seen)) if seen.any() else 0.0,
            flags=dict(Counter(flag.kind for flag in tracked.flags)),
            tracks=str(file),
        )

    def text(self) -> str:
        """For a terminal."""
        flags = ", ".join(f"{count} {kind}" for kind, count in self.flags.items()) or "none"
        shares = f"{self.seen:7.2%} {self.counts:7.2%} {self.filled:7.2%} {self.missing:8.2%}"
        return f"{self.frames:7d} {shares} {self.confidence:11.2f}  {flags}"

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)
