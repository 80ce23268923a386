"""From the videos of a session to tracks, with start boxes, a person's edits, filled gaps and flags."""

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import cv2
import numpy as np
import xarray as xr

from calib.options import Job
from swimcal.errors import Fault, FaultCollector, InputError, NotEnoughData
from swimcal.results import sha256_of, write_whole
from swimcal.session import SESSION_FILE, TrialSpec, usual_boxes
from swimcal.session_file import rate_is_off, usual_spacing_s
from swimcal.stage import Stage
from swimcal.tracks import save_tracks
from tracking.appearance import Grey
from tracking.body_chain import find_blobs
from tracking.boxes import StartBoxes, load_boxes, save_boxes
from tracking.decoding import is_without_times
from tracking.edits import EditLog, apply_edits
from tracking.find_boxes import click_page, doubtful_boxes, find_boxes
from tracking.follow_video import TRACKERS, Partial, TrackerName, follow_video, retracker
from tracking.gaps import fill_gaps
from tracking.judgement import trusted
from tracking.tracked import TrackedFiles, load_tracked, save_tracked, seen_in
from tracking.video import Frame, Video, VideoInfo

_RAW_FORM = 9  # version of the tracker
_FORM = 11  # version of how tracks are judged; raw ones are judged anew, not tracked anew
_SEARCHED = (0, 10, 30, 60)  # frames in which the boxes are sought first, …
_LOOKS = 40  # … and then in so many all over the film, or fewer where these are less than a second apart: a late robot


T = TypeVar("T")


class Videos:
    """Tracks the videos of a session; what has not changed is not tracked again.

    ``results/tracking/<trial>.csv`` with its states and flags is the trial after edits and filled gaps, in
    ``results/tracking/raw`` as the tracker left it; next to them the boxes and their picture.
    """

    def __init__(self, job: Job) -> None:
        self._job = job
        self._hashes: dict[Path, str] = {}
        self._without_times: dict[Path, bool] = {}
        self._boxes: dict[str, StartBoxes] = {}
        self._tracks: dict[str, xr.Dataset] = {}

    @property
    def folder(self) -> Path:
        """``results/tracking``."""
        return self._job.results / "tracking"

    def tracks(self, spec: TrialSpec) -> xr.Dataset:
        """Return the current tracks of one trial: edited, judged, with gaps filled.

        Raises:
            InputError: its boxes are missing, faulty or not found.
            NotEnoughData: the video cannot be read.
        """
        if spec.name not in self._tracks:
            with self._opened(spec) as video:
                self._tracks[spec.name] = self._tracked(spec, video)
        return self._tracks[spec.name]

    def _tracked(self, spec: TrialSpec, video: Video) -> xr.Dataset:
        boxes = self._boxes_in(spec, video)
        raw = self._raw(spec, video, boxes)
        tracked = self._corrected(spec, video, raw, boxes)
        size_px = video.info.width_px, video.info.height_px
        first = int(np.argmax(seen_in(tracked).any(axis=1)))  # before the boxes where the robot is seen before
        own = {"first_frame": first, "picture_px": size_px, "source": str(spec.video)}
        return trusted(tracked, self._job.robot).assign_attrs(own)

    def boxes(self, spec: TrialSpec) -> StartBoxes:
        """Return the start boxes of one trial, of the session or found in the first frames, and write their picture.

        Raises:
            InputError: its boxes are faulty or were not found; a page to click them then is in `folder`.
            NotEnoughData: the video cannot be read.
        """
        if spec.name not in self._boxes:
            boxes = self._checked_before(spec)
            if boxes is None:
                with self._opened(spec) as video:
                    boxes = self._boxes_in(spec, video)
            self._boxes[spec.name] = boxes
        return self._boxes[spec.name]

    def _checked_before(self, spec: TrialSpec) -> StartBoxes | None:
        """Return the boxes if their picture says that they were checked against this video; else None."""
        found = self._found_stage(spec)
        with suppress(InputError):  # which those who open the video report, with all other faults
            if spec.boxes is not None or found.is_current:
                boxes = load_boxes(spec.boxes or found.file, self._markers)
                return boxes if self._picture(spec, boxes).is_current else None
        return None

    def _picture(self, spec: TrialSpec, boxes: StartBoxes) -> Stage:
        checked = {"boxes": boxes.to_json(), "layout_m": self._layout_m}  # against which boxes are checked
        return self._stage(f"{spec.name}.boxes.png", spec, checked)

    def _boxes_in(self, spec: TrialSpec, video: Video) -> StartBoxes:
        if spec.name in self._boxes:
            return self._boxes[spec.name]
        boxes = self._given(spec, video) or self._found(spec, video)
        picture = self._picture(spec, boxes)
        from tracking.box_preview import write_preview  # it loads Matplotlib

        if picture.ensure(lambda: write_preview(picture.file, _frame(spec, video, boxes.frame).rgb(), boxes)):
            self._job.made.append(picture.file)
        return boxes

    def _given(self, spec: TrialSpec, video: Video) -> StartBoxes | None:
        return None if spec.boxes is None else load_boxes(spec.boxes, self._markers, video.info, self._layout_m)

    def click_page(self, spec: TrialSpec, frame: int | None = None) -> Path:
        """Write a page on which a person clicks the markers of one trial, starting from the boxes there are.

        It shows the frame of the boxes, or the one that is asked for.

        Raises:
            InputError: the video has no such frame.
            NotEnoughData: the video cannot be read.
        """
        page, names = self.folder / f"{spec.name}.click.html", self._markers
        with self._opened(spec) as video:
            if frame is None:
                suggested = None
                with suppress(InputError):
                    suggested = self._given(spec, video) or self._found(spec, video, with_page=False)
                first = next((each.number for each in video.frames()), 0)
                picture = _frame(spec, video, first if suggested is None else suggested.frame)
            else:
                picture = video.frame(frame)
                suggested = self._find(spec, picture)
            blobs = (*find_blobs(picture.luma, "bright"), *find_blobs(picture.luma, "dark"))
            place = Path(os.path.relpath(self._boxes_file(spec), self._job.session.folder)).as_posix()
            click = click_page(picture.rgb(), names, spec.name, picture.number, suggested, blobs, self._layout_m, place)
            write_whole(page, click)
        return page

    def _boxes_file(self, spec: TrialSpec) -> Path:
        """Return where a person's boxes belong: as the session names them, else next to the video."""
        return spec.boxes or usual_boxes(self._video(spec), spec.name)

    @property
    def _markers(self) -> tuple[str, ...]:
        return self._job.session.markers

    @cached_property
    def _layout_m(self) -> np.ndarray:
        """Places (m, 2) of the markers on the robot, m."""
        return self._job.robot.marker_positions_m(self._markers)[:, :2]

    def _found(self, spec: TrialSpec, video: Video, with_page: bool = True) -> StartBoxes:
        """Find the boxes in one of the first frames; they are kept from one run to the next."""
        stage = self._found_stage(spec)
        if stage.is_current:
            return load_boxes(stage.file, self._markers)
        self._job.progress(f"{spec.name}: looking for the markers", None)
        problems: list[InputError] = []
        spoiled: list[NotEnoughData] = []
        for number in _searched(video.info.frames):
            try:
                found = self._sought(spec, _frame(spec, video, number))
            except InputError as problem:
                problems.append(problem)
                continue
            except NotEnoughData as problem:
                spoiled.append(problem)
                continue
            save_boxes(stage.file, found)
            stage.mark()
            self._job.made.append(stage.file)
            return found
        if not problems:
            raise spoiled[0]
        if with_page:
            page, place = self.click_page(spec), self._boxes_file(spec)
            step = (
                f"Open {page} in a browser, click the markers, and save them as {place}. Then run this again. Is the "
                "robot not in its picture? Another frame: `calib track SESSION --click --frame 120`."
            )
            raise InputError([replace(problems[0].faults[0], next_step=step)])
        raise problems[0]

    def _find(self, spec: TrialSpec, frame: Frame) -> StartBoxes | None:
        """Find the boxes in a later frame; None where they are not certain."""
        with suppress(InputError):
            return self._sought(spec, frame, again=True)
        return None

    def _sought(self, spec: TrialSpec, frame: Frame, again: bool = False) -> StartBoxes:
        names, file = self._markers, str(spec.video)
        return find_boxes(frame.luma, self._layout_m, names, frame=frame.number, file=file, again=again)

    def _found_stage(self, spec: TrialSpec) -> Stage:
        settings = {"markers": self._markers, "layout_m": self._layout_m, "finder": 1}
        return self._stage(f"{spec.name}.boxes.json", spec, settings)

    def _raw(self, spec: TrialSpec, video: Video, boxes: StartBoxes) -> xr.Dataset:
        tracker = self._tracker(spec, boxes)
        stage, folder = self._raw_stage(spec, boxes, tracker), self.folder / "raw"
        if stage.is_current:
            return load_tracked(folder, spec.name)

        def progress(done: int, frames: int, fps: float) -> None:
            self._job.progress(f"tracking {spec.name}, {fps:.0f} frames a second", done / frames)

        resumed = Partial(folder / f".{spec.name}.partial.npz", stage.fingerprint)
        names = self._markers
        tracked = follow_video(video, boxes, names, tracker, resumed, progress, partial(self._find, spec))
        frame = video.frame(boxes.frame)
        flags = doubtful_boxes(Grey.of_boxes(frame, boxes, names).of(frame), boxes, names)
        tracked = tracked.assign_attrs(flags=(*flags, *tracked.flags))
        save_tracked(folder, spec.name, tracked)
        stage.mark(TrackedFiles.of(folder, spec.name))
        return tracked

    def _corrected(self, spec: TrialSpec, video: Video, raw: xr.Dataset, boxes: StartBoxes) -> xr.Dataset:
        assert spec.edits is not None
        log = EditLog.load(spec.edits, self._markers, len(raw.state))
        files, used = TrackedFiles.of(self.folder, spec.name), self._job.results / "tracks" / f"{spec.name}.csv"
        stage = self._corrected_stage(spec, boxes, bool(log.edits))
        if stage.is_current:
            return load_tracked(self.folder, spec.name)
        if log.edits:
            self._job.progress(f"{spec.name}: replaying {len(log.in_force)} edits", None)
        tracked = trusted(fill_gaps(apply_edits(raw, log, retracker(video))), self._job.robot)
        save_tracked(self.folder, spec.name, tracked)
        save_tracks(used, tracked.assign(confidence=tracked.weight))
        stage.mark((*files, used))
        self._job.made.extend([files.tracks, used])
        return tracked

    def _corrected_stage(self, spec: TrialSpec, boxes: StartBoxes, edited: bool) -> Stage:
        edits = {"edits": sha256_of(spec.edits)} if edited and spec.edits is not None else {}
        tracker = self._raw_stage(spec, boxes, self._tracker(spec, boxes))
        return Stage(TrackedFiles.of(self.folder, spec.name).tracks, edits, {"form": _FORM}, [tracker])

    def are_current(self, spec: TrialSpec) -> bool:
        """Tell whether the existing tracks are of this video, its boxes and its edits."""
        boxes = self._checked_before(spec)
        if boxes is None:
            return False
        assert spec.edits is not None
        edited = bool(EditLog.load(spec.edits, self._markers).edits)
        return self._corrected_stage(spec, boxes, edited).is_current

    def tracker_of(self, spec: TrialSpec) -> TrackerName:
        """Return the tracker whose tracks of this trial are used."""
        return self._tracker(spec, self.boxes(spec))

    def _tracker(self, spec: TrialSpec, boxes: StartBoxes) -> TrackerName:
        if self._job.options.tracker is not None:
            return self._job.options.tracker
        current = [name for name in TRACKERS if self._raw_stage(spec, boxes, name).is_current]
        return current[0] if current else TRACKERS[0]

    def _raw_stage(self, spec: TrialSpec, boxes: StartBoxes, tracker: TrackerName) -> Stage:
        settings = {"boxes": boxes.to_json(), "markers": self._markers, "tracker": tracker, "form": _RAW_FORM}
        file = TrackedFiles.of(Path("raw"), spec.name).tracks
        return self._stage(file, spec, settings | {"opencv": cv2.__version__})

    def _stage(self, file: str | Path, spec: TrialSpec, settings: Mapping[str, Any]) -> Stage:
        video = self._video(spec)
        if video not in self._without_times:
            self._without_times[video] = is_without_times(video)
        clock = {"fps": self._job.session.camera_of(spec).fps} if self._without_times[video] else {}
        return Stage(self.folder / file, {"video": self.sha256(video)}, {**settings, **clock})

    def sha256(self, path: Path) -> str:
        """Return the hash of a file, which is read once only: videos are long."""
        if path not in self._hashes:
            self._hashes[path] = sha256_of(path)
        return self._hashes[path]

    def _opened(self, spec: TrialSpec) -> Video:
        """Open the video of a trial.

        Raises:
            InputError: its time stamps show another frame rate than the session states.
            NotEnoughData: it cannot be read.
        """
        fps = self._job.session.camera_of(spec).fps
        try:
            video = Video(self._video(spec), self._job.options.workers, fps)
        except InputError as problem:
            raise spoiled(spec, self._video(spec), problem) from problem
        if video.info.frames > 1 and rate_is_off(fps, *usual_spacing_s(video.info.time_s)):
            video.close()
            raise _other_rate(self._job.session.folder / SESSION_FILE, fps, video.info)
        return video

    @staticmethod
    def _video(spec: TrialSpec) -> Path:
        assert spec.video is not None
        return spec.video


def _other_rate(file: Path, fps: float, info: VideoInfo) -> InputError:
    """Make the error for a video whose stamps show another frame rate than the session."""
    what, found = "a video has another frame rate", f"{fps:g}; by the time stamps of {info.file.name} {info.fps:.4g}"
    step = (
        "Which of them is right? Correct fps (in its [[trial]], if other trials have another), or stamp the film anew: "
        "slow motion is stamped with another rate than it was filmed at, and frequencies and speeds go by the stamps."
    )
    return InputError([Fault(str(file), "camera.fps", what, found, "the same within 5 %", next_step=step)])


def _searched(frames: int) -> list[int]:
    """Return the frames in which boxes are sought, until they are found."""
    every = max(_SEARCHED[-1] // 2, frames // _LOOKS)
    return [number for number in (*_SEARCHED, *range(_SEARCHED[-1] + every, frames, every)) if number < frames]


def _frame(spec: TrialSpec, video: Video, number: int) -> Frame:
    """Decode a frame of the video of a trial.

    Raises:
        NotEnoughData: it cannot be decoded.
    """
    try:
        return video.frame(number)
    except InputError as problem:
        raise spoiled(spec, video.info.file, problem) from problem


def spoiled(spec: TrialSpec, file: Path, problem: InputError) -> NotEnoughData:
    """Make the error that leaves out a trial one of whose files cannot be used."""
    faults = " ".join(fault.describe() for fault in problem.faults)
    return NotEnoughData(f"trial {spec.name}: {file.name}: {faults}")


class OfEach(NamedTuple, Generic[T]):
    """Result of each trial, and why it was not of those that cannot be used; by name."""

    made: dict[str, T]
    left_out: dict[str, str]

    def all_or_none(self) -> dict[str, T]:
        """Return what was made.

        Raises:
            NotEnoughData: a trial cannot be used; all of them at once.
        """
        if self.left_out:
            raise NotEnoughData("\n".join(f"trial {name}: {why}" for name, why in self.left_out.items()))
        return self.made


class FaultyTrials(InputError):
    """The faults of some trials, raised after something was made of all others.

    Attributes:
        others: what was made of the others.
    """

    def __init__(self, faults: Iterable[Fault], others: OfEach[Any]) -> None:
        super().__init__(faults)
        self.others = others


def of_each(specs: Iterable[TrialSpec], make: Callable[[TrialSpec], T]) -> OfEach[T]:
    """Make something of each trial; one that is faulty, or cannot be used, does not keep the others from it.

    Raises:
        FaultyTrials: at the end, with the faults of all.
    """
    found, faults = OfEach[T]({}, {}), FaultCollector()
    for spec in specs:
        try:
            with faults.nested():
                found.made[spec.name] = make(spec)
        except NotEnoughData as problem:
            found.left_out[spec.name] = without_trial(spec.name, problem)
    if faults:
        raise FaultyTrials(faults.faults, found)
    return found


def without_trial(name: str, problem: NotEnoughData) -> str:
    """Say why a trial cannot be used, without its name in front."""
    return str(problem).removeprefix(f"trial {name}: ")
