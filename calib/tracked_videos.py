"""Tracking and correcting videos on the command line: what is tracked, what fails, what is reported."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from calib.options import Options
from calib.pipeline import Pipeline, working
from calib.results.tracks import shares_of
from calib.stages.videos import of_each
from session import CameraSpec, Flag, InputError, NotEnoughData, Session, TrialSpec
from session.errors import Fault
from session.results import plain_json
from swimmer import RobotSpec
from tracking import to_pool
from tracking.lens import lens_flags
from tracking.records import EditLog, TrackedTrial, export_tracks
from tracking.records.formats import FORMATS
from tracking.tracker import TrackerName
from tracking.video import Video


def camera_flags(found: Iterable[TrackedTrial], camera: CameraSpec, robot: RobotSpec) -> tuple[Flag, ...]:
    """The flags of lens, size and height, of each kind the first: the videos share one camera.

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


_SUFFIX = {"swimcal": ".csv", "deeplabcut": ".dlc.csv", "fishsim": ".fishsim.csv"}


def check_form(form: str, option: str) -> None:
    """That tracks can be written in this form.

    Raises:
        InputError: they cannot; lists the forms.
    """
    if form not in FORMATS:
        raise InputError([Fault(option, "", "no such form of tracks", repr(form), "", tuple(FORMATS))])


def write_click_pages(folder: Path, as_json: bool) -> None:
    """A page a video on which to click its start boxes; prints where they are.

    Raises:
        InputError: no video, or one that cannot be read.
    """
    with working(folder, as_json) as pipeline:
        pages = of_each(_filmed(pipeline.session), pipeline.recordings.videos.click_page)
    files = {name: str(page) for name, page in pages.items()}
    print(json.dumps(files, indent=1) if as_json else "\n".join(files.values()))


def track_videos(pipeline: Pipeline, export: str) -> tuple[dict[str, TrackedTrial], list[Path]]:
    """The tracks of every video of a session, up to date, and the files that they were exported to.

    Args:
        pipeline: of the session.
        export: a form of `tracking.records.FORMATS` to write next to them; empty for none.

    Raises:
        InputError: no video, or no such form; or faults of videos, boxes or edits, after all other videos are tracked.
    """
    if export:
        check_form(export, "--export")
    filmed, videos, exported = _filmed(pipeline.session), pipeline.recordings.videos, []
    of_each(filmed, videos.boxes)
    tracks = of_each(filmed, videos.tracks)
    if export:
        for name, found in tracks.items():
            exported.append(videos.folder / f"{name}{_SUFFIX.get(export, '.nc')}")
            export_tracks(found, exported[-1], export)
    return tracks, exported


def print_tracks(session: Path, method: TrackerName | None, export: str, workers: int, as_json: bool) -> None:
    """Tracks the videos of a session and prints the outcome of each; arguments as of `calib.track`."""
    with working(session, as_json, Options(workers=workers, tracker=method)) as pipeline:
        tracks, exported = track_videos(pipeline, export)
        videos = pipeline.recordings.videos
        boxes = of_each(_filmed(pipeline.session), videos.boxes)
    of_camera = camera_flags(tracks.values(), pipeline.session.camera, pipeline.job.robot)
    if as_json:
        report = {
            name: shares_of(found)
            | {"tracks": str(videos.folder / f"{name}.csv"), "boxes": boxes[name].to_json()}
            | {"flags": [flag.to_json() for flag in found.flags], "camera": [flag.to_json() for flag in of_camera]}
            for name, found in tracks.items()
        }
        print(json.dumps(plain_json(report), indent=1))
        return
    shares = f"{'seen':>7} {'counts':>7} {'filled':>7} {'missing':>8}"
    print(f"{'trial':12} {'frames':>7} {shares} {'confidence':>11}  flags")
    for name, found in tracks.items():
        flags = ", ".join(f"{count} {kind}" for kind, count in Counter(flag.kind for flag in found.flags).items())
        row = "{frames:7d} {seen:7.2%} {counts:7.2%} {filled:7.2%} {missing:8.2%} {confidence:11.2f}"
        print(f"{name:12} {row.format(**shares_of(found))}  {flags or 'none'}")
    for name, found in tracks.items():
        whole = [flag for flag in found.flags if flag.frames is None and flag.message]
        print("".join(f"! {name}: {flag.message}\n" for flag in whole), end="")
    print("".join(f"! {flag.message}\n" for flag in of_camera), end="")
    print("".join(f"{path}\n" for path in exported), end="")
    print(videos.folder)


def correct_track(session: Path, trial: str, correction: str | Mapping[str, Any]) -> str:
    """Adds a correction, a mapping or JSON, to the edit log of a trial; in a sentence how many count.

    Raises:
        InputError: no such trial, or the correction or the log has faults.
    """
    text = correction if isinstance(correction, str) else json.dumps(correction)
    with working(session, True) as pipeline:
        log = _log(pipeline.session, pipeline.session.trial(trial)).append(text)
    edits = "1 edit counts" if len(log.in_force) == 1 else f"{len(log.in_force)} edits count"
    return f"{log.path}: added line {log.edits[-1].line}; {edits}. `calib track` replays them"


def _filmed(session: Session) -> list[TrialSpec]:
    """The trials to be tracked: those with a video and no tracks of their own.

    Raises:
        InputError: there is none.
    """
    filmed = [spec for spec in session.trials if spec.video is not None and spec.tracks is None]
    if not filmed:
        file, found = str(session.folder / "session.toml"), f"{len(session.trials)} trials"
        raise InputError([Fault(file, "", "no video to track", found, 'a trial with video = "…"')])
    return filmed


def _log(session: Session, spec: TrialSpec) -> EditLog:
    """The edit log of a trial, and its number of frames, for edits to be held against.

    Raises:
        InputError: the trial is not tracked from a video, its video cannot be read, or the log has faults.
    """
    if spec.video is None or spec.edits is None or spec.tracks is not None:
        what = "it has no video" if spec.video is None else "its tracks come from a file, not from its video"
        choices = tuple(each.name for each in session.trials if each.video is not None and each.tracks is None)
        file, expected = str(session.folder / "session.toml"), "a trial whose video is tracked here"
        raise InputError([Fault(file, f"trial {spec.name}", what, "", expected, choices)])
    with Video(spec.video) as video:
        return EditLog.load(spec.edits, session.markers, video.info.frames)
