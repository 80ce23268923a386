"""The tracking and correcting of videos on the command line: what is tracked, what fails, what is reported."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from calib.pipeline import Pipeline, working
from calib.results.tracks import FilmedTracks, TrackResult, shares_of
from calib.stages.videos import FaultyTrials, OfEach, Videos, of_each
from fitting.left_out import left_out_flags
from reports.words import listed
from swimcal.errors import Fault, InputError, NotEnoughData
from swimcal.flags import Flag
from swimcal.results import plain_json
from swimcal.robot import RobotSpec
from swimcal.session import Session, TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of
from tracking.boxes import StartBoxes
from tracking.camera import lens_flags, to_pool
from tracking.edits import EditLog
from tracking.formats import FORMATS, export_tracks
from tracking.tracked import mask_untrusted
from tracking.video import Video

_SUFFIX = {"swimcal": ".csv", "deeplabcut": ".dlc.csv", "fishsim": ".fishsim.csv"}


class PartlyTracked(InputError):
    """The faults of some films, raised after all others were tracked.

    Attributes:
        tracks: tracks of the others, by trial.
        filmed: what was made from the others.
    """

    def __init__(self, faults: Iterable[Fault], tracks: Mapping[str, xr.Dataset], filmed: FilmedTracks) -> None:
        super().__init__(faults)
        self.tracks, self.filmed = tracks, filmed


def check_form(form: str, option: str) -> None:
    """Raise an `InputError` that lists the forms where tracks cannot be written in this one."""
    if form not in FORMATS:
        raise InputError([Fault(option, "", "no such form of tracks", repr(form), "", tuple(FORMATS))])


def click_pages(pipeline: Pipeline, frame: int | None = None) -> tuple[Path, ...]:
    """Write a page a video on which to click its start boxes in a frame; an `InputError` where there is no video."""
    page = pipeline.recordings.videos.click_page
    return tuple(of_each(filmed_trials(pipeline.session), lambda spec: page(spec, frame)).all_or_none().values())


def track_videos(pipeline: Pipeline, export: str) -> FilmedTracks:
    """Bring the tracks of every video of a session up to date, and write them in another form.

    Raises:
        InputError: no such form.
        PartlyTracked: faults of boxes or edits, after all other videos are tracked.
        NotEnoughData: no video can be read.
    """
    if export:
        check_form(export, "--export")
    videos, exported = pipeline.recordings.videos, []
    found, faults = _track_each([spec for spec in pipeline.session.trials if is_filmed(spec)], videos)
    made = found.made if faults else found.made or found.all_or_none()
    boxes = {name: of_trial for name, (of_trial, _) in made.items()}
    tracks = {name: of_trial for name, (_, of_trial) in made.items()}
    for name, own in tracks.items() if export else ():
        exported.append(videos.folder / f"{name}{_SUFFIX.get(export, '.nc')}")
        export_tracks(own, exported[-1], export)
    flags = camera_flags(tracks.values(), pipeline.session.camera, pipeline.job.robot)
    filmed = FilmedTracks(videos.folder, boxes, flags, tuple(exported), found.left_out)
    if faults:
        raise PartlyTracked(faults, tracks, filmed)
    return filmed


def _track_each(
    filmed: Iterable[TrialSpec], videos: Videos
) -> tuple[OfEach[tuple[StartBoxes, xr.Dataset]], tuple[Fault, ...]]:
    """Track all films; return their boxes and tracks, and the faults of those that cannot be tracked as they are."""
    try:
        return of_each(filmed, lambda spec: (videos.boxes(spec), videos.tracks(spec))), ()
    except FaultyTrials as problem:
        return problem.others, problem.faults


def print_tracks(found: TrackResult, as_json: bool) -> None:
    """Print the tracks of every video, or that all tracks are given; an `InputError` where there is neither."""
    filmed = found.filmed
    if not filmed.boxes and not as_json:
        given = list(found.tracked) or [spec.name for spec in filmed_trials(found.session)]
        print(f"No video to track: the tracks of {listed(given, 4)} are given.\n{found.summary()}")
        print("".join(f"! {flag.message}\n" for flag in found.left_out), end="")
        return
    print_filmed({name: found.tracked[name] for name in filmed.boxes}, filmed, found.left_out, as_json)


def print_others(problem: PartlyTracked, as_json: bool) -> None:
    """Print the tracks of the films without faults, if there are any."""
    if problem.tracks:
        print_filmed(problem.tracks, problem.filmed, left_out_flags(problem.filmed.left_out), as_json)


def print_filmed(
    tracks: Mapping[str, xr.Dataset], filmed: FilmedTracks, left_out: Sequence[Flag], as_json: bool
) -> None:
    """Print a table of tracks, and what is to be said of them; or all that as JSON.

    Args:
        tracks: the tracks that were made from films, by trial.
        filmed: what else was made from the films.
        left_out: flags of the trials that cannot be used.
        as_json: print JSON.
    """
    if as_json:
        report = {
            name: shares_of(own)
            | {"tracks": str(filmed.folder / f"{name}.csv"), "boxes": filmed.boxes[name].to_json()}
            | {"flags": [flag.to_json() for flag in own.flags], "camera": [flag.to_json() for flag in filmed.flags]}
            for name, own in tracks.items()
        }
        spoiled = filmed.left_out.items()
        report |= {name: {"flags": [flag.to_json() for flag in left_out_flags({name: why})]} for name, why in spoiled}
        print(json.dumps(plain_json(report), indent=1))
        return
    shares = f"{'seen':>7} {'counts':>7} {'filled':>7} {'missing':>8}"
    print(f"{'trial':12} {'frames':>7} {shares} {'confidence':>11}  flags")
    for name, own in tracks.items():
        flags = ", ".join(f"{count} {kind}" for kind, count in Counter(flag.kind for flag in own.flags).items())
        row = "{frames:7d} {seen:7.2%} {counts:7.2%} {filled:7.2%} {missing:8.2%} {confidence:11.2f}"
        print(f"{name:12} {row.format(**shares_of(own))}  {flags or 'none'}")
    for name, own in tracks.items():
        whole = [flag for flag in own.flags if flag.frames is None and flag.message]
        print("".join(f"! {name}: {flag.message}\n" for flag in whole), end="")
    print("".join(f"! {flag.message}\n" for flag in (*left_out, *filmed.flags)), end="")
    print("".join(f"{path}\n" for path in filmed.exported), end="")
    print(filmed.folder)


def correct_track(session: Path, trial: str, correction: str | Mapping[str, Any]) -> str:
    """Add a correction, a mapping or JSON, to the edit log of a trial; return a sentence with how many count.

    Args:
        session: the session folder.
        trial: name of the trial.
        correction: the correction, a mapping or JSON.
    """
    text = correction if isinstance(correction, str) else json.dumps(correction)
    with working(session, True, needs_commands=False) as pipeline:
        log = _log(pipeline.session, pipeline.session.trial(trial)).append(text)
    edits = "1 edit counts" if len(log.in_force) == 1 else f"{len(log.in_force)} edits count"
    return f"{log.path}: added line {log.edits[-1].line}; {edits}. `calib track` replays them"


def is_filmed(spec: TrialSpec) -> bool:
    """Return whether a trial is to be tracked: it has a video and no tracks of its own."""
    return spec.video is not None and spec.tracks is None


def filmed_trials(session: Session) -> list[TrialSpec]:
    """List the trials to be tracked; an `InputError` where there is none."""
    filmed = [spec for spec in session.trials if is_filmed(spec)]
    if not filmed:
        file, found = str(session.folder / "session.toml"), f"{len(session.trials)} trials"
        raise InputError([Fault(file, "", "no video to track", found, 'a trial with video = "…"')])
    return filmed


def _log(session: Session, spec: TrialSpec) -> EditLog:
    """Load the edit log of a trial; an `InputError` where it is not tracked from a video."""
    if spec.video is None or spec.edits is None or spec.tracks is not None:
        what = "it has no video" if spec.video is None else "its tracks come from a file, not from its video"
        choices = tuple(each.name for each in session.trials if is_filmed(each))
        file, expected = str(session.folder / "session.toml"), "a trial whose video is tracked here"
        raise InputError([Fault(file, f"trial {spec.name}", what, "", expected, choices)])
    with Video(spec.video) as video:
        return EditLog.load(spec.edits, session.markers, video.info.frames)


def camera_flags(found: Iterable[xr.Dataset], camera: CameraSpec, robot: RobotSpec) -> tuple[Flag, ...]:
    """Collect the flags of lens, size and height, of each kind the first: the videos share one camera."""
    flags: dict[str, Flag] = {}
    for tracks in found:
        scale = _metres_per_px(tracks, camera, robot)
        for flag in lens_flags(camera, picture_px=tracks.picture_px, metres_per_px=scale):
            flags.setdefault(flag.kind, flag)
    return tuple(flags.values())


def _metres_per_px(found: xr.Dataset, camera: CameraSpec, robot: RobotSpec) -> float | None:
    """Measure the scale by the nose-neck distance; None where nose and neck are never seen."""
    tracks = mask_untrusted(found)
    heights_m = robot.marker_positions_m(markers_of(tracks))[:, 2]
    try:
        return to_pool(tracks, camera, tracks.confidence.values, heights_m)[1]
    except NotEnoughData:
        return None
