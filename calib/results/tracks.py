"""The tracks of a session: made from its videos, corrected, and as a result with a labelled dataset a trial.

`track_videos` and `correct_track` are what `calib track` and `calib edit` do, `print_tracks` is what they say;
`TrackResult` has one `xarray.Dataset` a trial, with flags and shares of what was seen.
"""

from __future__ import annotations

import json
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from calib.pipeline import Pipeline, working
from calib.results.result import TIME, Tables, flag_frame, flag_lines
from calib.stages.videos import FaultyTrials, OfEach, Videos, of_each
from fitting.left_out import left_out_flags
from fitting.trial import MeasuredTrial
from reports.words import counted, listed, percent
from swimcal.errors import Fault, InputError, NotEnoughData
from swimcal.flags import Flag
from swimcal.results import plain_json
from swimcal.robot import RobotSpec
from swimcal.session import Session, TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of
from tracking.boxes import Box, StartBoxes
from tracking.camera import lens_flags, to_pool
from tracking.edits import Edit, EditLog, SetBox
from tracking.find_boxes import check_box
from tracking.formats import FORMATS, export_tracks, to_movement
from tracking.tracked import SampleState, mask_untrusted, seen_in
from tracking.video import Video

_SUFFIX = {"swimcal": ".csv", "deeplabcut": ".dlc.csv", "fishsim": ".fishsim.csv"}


@dataclass(frozen=True, eq=False)
class FilmedTracks:
    """The files made from the videos of a session: tracks in a folder, start boxes, tracks in another form.

    Flags are those of lens, size and height, of each kind the first: the videos share one camera. `left_out` has the
    reason for each trial whose video cannot be read.
    """

    folder: Path
    boxes: Mapping[str, StartBoxes] = field(default_factory=dict)
    flags: tuple[Flag, ...] = ()
    exported: tuple[Path, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class TrackResult(Tables, Mapping[str, "xr.Dataset"]):
    """The tracks of every trial: a mapping from the trial's name to an `xarray.Dataset`.

    A dataset has the dimensions `time` (s), `space` (x to the right, y down) and `keypoint`, its name as coordinate
    `trial`, and the variables

    - `position` (time, space, keypoint), px, nan where missing, and `confidence` (time, keypoint), as in `movement`;
    - `state` (time, keypoint), how each sample came about, and `size` (time, keypoint), the marker's diameter in px;
    - of a swim trial also `weight` (time, keypoint), 0 where a sample does not count in a fit; `position_pool`, m, on
      the pool's surface, right-handed seen from above; `position_head`, m, in the frame of the head (published
      normaliser: x from nose to neck, y to the right); `heading` (time), rad; `forward` (time), distance swum, m.
      Outside the frames that are measured they are nan, `weight` 0.

    Tables of `to_frame`: "trials" (frames, shares of samples seen, filled and missing, and of a swim trial beat and
    speed) and "flags".

    Attributes:
        tracked: the tracker's record of every sample, by trial.
        measured: the swim trials, measured.
        flags: by trial.
        filmed: what was made from the videos.
        notes: sentences from its making.

    Example:
        >>> tracks = calib.track("pool", progress=False)
        >>> print(tracks.summary())
        synthetic: 2 trials, 320 frames...
        >>> tracks["slow"].position.sel(keypoint="nose").dims
        ('time', 'space')
        >>> tracks.to_frame().speed.idxmax()
        'fast'
    """

    session: Session
    tracked: Mapping[str, xr.Dataset]
    measured: Mapping[str, MeasuredTrial]
    flags: Mapping[str, tuple[Flag, ...]]
    filmed: FilmedTracks
    notes: tuple[str, ...] = ()

    def __getitem__(self, trial: str) -> xr.Dataset:
        if trial not in self.tracked:
            raise InputError([Fault("trial", "", "no tracks of this trial", repr(trial), "", tuple(self.tracked))])
        tracked = self.tracked[trial]
        data = to_movement(tracked).isel(individual=0, drop=True)
        data = data.assign_coords(trial=trial, time=data.time.assign_attrs(TIME))
        if (swim := self.measured.get(trial)) is None:
            return data
        measured = _collect_measured(swim, data.time[tracked.first_frame + swim.first_frame :])
        found = data.assign(measured.reindex(time=data.time, fill_value={"weight": 0.0}))
        return found.assign_attrs(metres_per_px=swim.metres_per_px)

    def __iter__(self) -> Iterator[str]:
        return iter(self.tracked)

    def __len__(self) -> int:
        return len(self.tracked)

    def __repr__(self) -> str:
        frame = self.to_frame()
        trials = f"{counted(len(frame), 'trial')}, {int(frame.frames.sum())} frames"
        return f"<TrackResult {self.session.name}: {trials}, {percent(frame.seen.mean())} of the samples seen>"

    @property
    def left_out(self) -> tuple[Flag, ...]:
        """Return the flags of the trials that cannot be used, which say why."""
        return tuple(flag for own in self.flags.values() for flag in own if flag.kind == "left_out")

    def summary(self) -> str:
        """Summarise how much was seen, and the flags, in three lines."""
        frame = self.to_frame()
        worst = frame.seen.idxmin()
        kinds = Counter(flag.kind for own in self.flags.values() for flag in own)
        flags = ", ".join(f"{kind.replace('_', ' ')} ({count})" for kind, count in kinds.most_common(4))
        return "\n".join(
            [
                f"{self.session.name}: {counted(len(frame), 'trial')}, {int(frame.frames.sum())} frames.",
                f"Seen: {frame.seen.mean():.1%} of the samples; least in {worst}, {frame.seen[worst]:.1%}.",
                f"Flags: {flags or 'none'}. Next: calib fit {self.session.in_shell}",
            ]
        )

    def details(self) -> list[str]:
        """List every flag, a line each."""
        return flag_lines(self._every_flag())

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {"trials": self._trials, "flags": lambda: flag_frame(self._every_flag())}

    def _every_flag(self) -> Iterator[tuple[str, Flag]]:
        return ((name, flag) for name, own in self.flags.items() for flag in own)

    def _trials(self) -> pd.DataFrame:
        rows = {name: self._row(name, found) for name, found in self.tracked.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("trial")

    def _row(self, name: str, found: xr.Dataset) -> dict[str, object]:
        shares = shares_of(found)
        row: dict[str, object] = {column: shares[column] for column in ("frames", "seen", "filled", "missing")}
        row["flags"] = len(self.flags[name])
        row["commanded_hz"] = self.session.trial(name).commanded_hz
        swim = self.measured.get(name)
        if swim is None:
            return row
        frequency = swim.frequency
        row |= {"frequency_hz": frequency.hz, "frequency_se_hz": frequency.se_hz}
        return row | {"speed": swim.speed, "used": swim.used_fraction}


def shares_of(found: xr.Dataset) -> dict[str, float]:
    """Count the frames of a trial, and the shares of its samples that were seen, count, are filled and missing.

    Samples count from the frame of the boxes on; the mean confidence of those seen is added. Not all samples that are
    seen count in a fit: see `docs/tracking.md`.
    """
    own = found.isel(time=slice(found.first_frame, None))
    seen, missing = seen_in(own), own.state.values == SampleState.MISSING
    shares = {"seen": seen, "filled": ~missing & ~seen, "missing": missing}
    if "weight" in own:
        shares["counts"] = own.weight.values > 0
    confidence = np.average(own.confidence.values, weights=seen) if seen.any() else 0.0
    row = {"frames": found.sizes["time"], "confidence": float(confidence)}
    return row | {name: float(share.mean()) for name, share in shares.items()}


def _collect_measured(swim: MeasuredTrial, time: xr.DataArray) -> xr.Dataset:
    """Return what is measured in a swim, its frames at the first of these times."""
    own = swim.tracks[["weight", "position_pool", "position_head", "heading"]]
    forward = -swim.tracks.path.sel(space="x", drop=True)
    own = own.assign(forward=forward.assign_attrs(units="m", long_name="distance swum"))
    return own.assign_coords(time=time[: own.sizes["time"]])


# The tracking and correcting of videos: what is tracked, what fails, what is reported.


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


def print_tracks(found: TrackResult, as_json: bool, verbose: bool = False) -> None:
    """Print the tracks of every video, or that all tracks are given; an `InputError` where there is neither."""
    filmed = found.filmed
    if not filmed.boxes and not as_json:
        given = list(found.tracked) or [spec.name for spec in filmed_trials(found.session)]
        print(f"No video to track: the tracks of {listed(given, 4)} are given.\n{found.summary()}")
        print("".join(f"! {flag.message}\n" for flag in found.left_out), end="")
        return
    print_filmed({name: found.tracked[name] for name in filmed.boxes}, filmed, found.left_out, as_json, verbose)


def print_others(problem: PartlyTracked, as_json: bool, verbose: bool = False) -> None:
    """Print the tracks of the films without faults, if there are any."""
    if problem.tracks:
        print_filmed(problem.tracks, problem.filmed, left_out_flags(problem.filmed.left_out), as_json, verbose)


def print_filmed(
    tracks: Mapping[str, xr.Dataset],
    filmed: FilmedTracks,
    left_out: Sequence[Flag],
    as_json: bool,
    verbose: bool = False,
) -> None:
    """Print a table of tracks, and what is to be said of them; or all that as JSON.

    Args:
        tracks: the tracks that were made from films, by trial.
        filmed: what else was made from the films.
        left_out: flags of the trials that cannot be used.
        as_json: print JSON.
        verbose: also print the flags of single markers or frames.
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
    wide = max(12, *map(len, tracks))
    print(f"{'trial':{wide}} {'frames':>7} {shares} {'confidence':>11}  flags")
    for name, own in tracks.items():
        flags = ", ".join(f"{count} {kind}" for kind, count in Counter(flag.kind for flag in own.flags).items())
        row = "{frames:7d} {seen:7.2%} {counts:7.2%} {filled:7.2%} {missing:8.2%} {confidence:11.2f}"
        print(f"{name:{wide}} {row.format(**shares_of(own))}  {flags or 'none'}")
    told = [(name, flag) for name, own in tracks.items() for flag in own.flags if verbose or flag.frames is None]
    told += [("", flag) for flag in (*left_out, *filmed.flags)]
    print("".join(f"{line}\n" for line in flag_lines((name, flag) for name, flag in told if flag.message)), end="")
    print("".join(f"{path}\n" for path in filmed.exported), end="")
    print(filmed.folder)


def correct_track(session: Path, trial: str, correction: str | Mapping[str, Any]) -> str:
    """Add a correction, a mapping or JSON, to the edit log of a trial.

    Args:
        session: the session folder.
        trial: name of the trial.
        correction: the correction, a mapping or JSON.

    Returns:
        A sentence with how many count, and how to take this one back.
    """
    text = correction if isinstance(correction, str) else json.dumps(correction)
    with working(session, True, needs_commands=False) as pipeline:
        opened = pipeline.session
        with _edited_video(opened, opened.trial(trial)) as (video, log):
            log = log.append(text, partial(_check_edit, video))
    edits = "1 edit counts" if len(log.in_force) == 1 else f"{len(log.in_force)} edits count"
    line = log.edits[-1].line
    undo = f"""calib edit {opened.in_shell} {shlex.quote(trial)} '{{"op": "undo", "line": {line}}}'"""
    return f"{log.path}: added line {line}; {edits}. `calib track` replays them; `{undo}` takes this back"


def _check_edit(video: Video, edit: Edit) -> None:
    """Raise an `InputError` where a marker is to be tracked on from a box that holds none."""
    if isinstance(edit, SetBox) and edit.until != edit.frame:
        frame = video.frame(edit.frame)
        try:
            check_box(str(video.info.file), frame, Box(*edit.box), edit.marker)
        except InputError as problem:
            step = "Look up where its dot is in that frame: `calib view SESSION --open`. The box holds the whole dot."
            raise InputError([replace(fault, next_step=step) for fault in problem.faults]) from problem


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


@contextmanager
def _edited_video(session: Session, spec: TrialSpec) -> Iterator[tuple[Video, EditLog]]:
    """Give the video of a trial and its edit log; an `InputError` where it is not tracked from a video."""
    if spec.video is None or spec.edits is None or spec.tracks is not None:
        what = "it has no video" if spec.video is None else "its tracks come from a file, not from its video"
        choices = tuple(each.name for each in session.trials if is_filmed(each))
        file, expected = str(session.folder / "session.toml"), "a trial whose video is tracked here"
        raise InputError([Fault(file, f"trial {spec.name}", what, "", expected, choices)])
    with Video(spec.video) as video:
        yield video, EditLog.load(spec.edits, session.markers, video.info.frames)


def camera_flags(found: Iterable[xr.Dataset], camera: CameraSpec, robot: RobotSpec) -> tuple[Flag, ...]:
    """Collect the flags of lens, size and height, of each kind the first: the videos share one camera."""
    flags: dict[str, Flag] = {}
    for tracks in found:
        scale = _metres_per_px(tracks, camera, robot)
        for flag in lens_flags(camera, mask_untrusted(tracks), tracks.picture_px, scale):
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
