"""From a video and its start boxes to tracks: one pass over the frames, which can be interrupted and taken up again."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Literal, get_args

import numpy as np

from session import Fault, Flag, InputError, Tracks
from tracking.boxes import StartBoxes
from tracking.records import SampleState, TrackedTrial, only_csrt_flags
from tracking.suspects import stretches
from tracking.tracker.opencv_threads import opencv_on_one_thread
from tracking.tracker.partial import Partial
from tracking.tracker.plain_csrt import PlainCsrt
from tracking.tracker.tracker import MarkerTracker, Sighting
from tracking.tracker.without_marker import LEAST_CONTRAST, without_marker
from tracking.video import Frame, Video

TrackerName = Literal["hybrid", "spots", "csrt"]
TRACKERS: tuple[TrackerName, ...] = get_args(TrackerName)
"""hybrid: spots, and CSRT where none answers; spots: without CSRT; csrt: plain CSRT, the baseline."""

PREDICTED_FOR = 12
"""Frames for which the position of an unseen marker is carried on; after that it is missing."""
_SNAPSHOT_EVERY = 30  # frames at least; from the last of these interrupted work goes on
_KEEP_EVERY = 600  # frames at least; the snapshot is written then, and when the work is interrupted
_TELL_EVERY_S = 0.2

_ROWS, _ROWS_OF = "rows_", ("position_px", "confidence", "size_px", "state", "by_csrt")

Progress = Callable[[int, int, float], None]
"""Called with frames done, frames in all, and frames a second."""


class _Record:
    """What was seen so far, frame by frame.

    Args:
        frames, markers: how many.
    """

    def __init__(self, frames: int, markers: int) -> None:
        self.position_px = np.full((frames, markers, 2), np.nan)
        self.confidence = np.zeros((frames, markers))
        self.size_px = np.full((frames, markers), np.nan)
        self.state = np.zeros((frames, markers), np.int8)
        self.by_csrt = np.zeros((frames, markers), bool)
        self.unseen = np.zeros(markers, int)  # for how many frames now
        self.end = 0  # one past the last frame taken in

    def add(self, number: int, sighting: Sighting) -> None:
        self.unseen = np.where(sighting.seen, 0, self.unseen + 1)
        carried = ~sighting.seen & (self.unseen <= PREDICTED_FOR)
        self.position_px[number] = np.where((sighting.seen | carried)[:, None], sighting.position_px, np.nan)
        self.confidence[number] = sighting.confidence
        self.size_px[number] = sighting.diameter_px
        self.state[number] = np.where(sighting.seen, SampleState.MEASURED, carried * SampleState.PREDICTED)
        self.by_csrt[number] = sighting.by_csrt
        self.end = number + 1

    def arrays(self) -> dict[str, np.ndarray]:
        rows = {f"{_ROWS}{name}": getattr(self, name)[: self.end] for name in _ROWS_OF}
        return rows | {"record_unseen": self.unseen}

    def take_back(self, kept: dict[str, np.ndarray]) -> None:
        self.unseen = kept["record_unseen"]
        self.end = len(kept[f"{_ROWS}state"])
        for name in _ROWS_OF:
            getattr(self, name)[: self.end] = kept[f"{_ROWS}{name}"]


def follow_video(
    video: Video,
    boxes: StartBoxes,
    markers: Sequence[str],
    method: TrackerName = "hybrid",
    partial: Partial | None = None,
    progress: Progress | None = None,
) -> TrackedTrial:
    """Tracks the markers from the frame of their boxes to the end of the video.

    Row k is frame k; frames before that of the boxes, and frames that cannot be read, hold no samples. Interrupted,
    it leaves what was tracked so far in `partial` and goes on from there the next time, with the same result.

    Args:
        video: opened; CSRT takes as many threads as it decodes with.
        boxes: of all the markers, in one frame.
        markers: their names, in the order wanted.
        method: one of `TRACKERS`.
        partial: where to keep what was tracked so far; None: nowhere.
        progress: called now and then.

    Raises:
        InputError: the frame of the boxes is not in the video, or a box holds no marker.
        ValueError: an unknown method.
    """
    if method not in TRACKERS:
        raise ValueError(f"no tracker {method!r}; choices: {', '.join(TRACKERS)}")
    record = _Record(video.info.frames, len(markers))
    with opencv_on_one_thread():
        tracker: MarkerTracker | PlainCsrt | None = None if method == "csrt" else _taken_up(video, record, partial)
        if tracker is not None:
            onwards = video.frames(record.end)
        else:
            tracker, first, onwards = _begun(video, boxes, tuple(markers), method)
            record.add(boxes.frame, first)
        _follow(video, onwards, tracker, record, partial, progress)
    return _result(video, tuple(markers), record)


def _taken_up(video: Video, record: _Record, partial: Partial | None) -> MarkerTracker | None:
    kept = partial.read() if partial is not None else None
    if kept is None or "record_unseen" not in kept:
        return None
    tracker, end = MarkerTracker.restored(kept, video.threads), len(kept[f"{_ROWS}state"])
    if tracker.faint is not None:
        frames = video.frames(end - min(tracker.faint.behind, end), end)
        if not tracker.faint.replay(frame.luma for frame in frames):  # some of them cannot be read
            return None
    record.take_back(kept)
    return tracker


def _from_boxes(video: Video, number: int) -> tuple[Frame, Iterator[Frame]]:
    """The frame of the boxes and those after it, decoded in one go.

    Raises:
        InputError: there is no such frame, or it cannot be decoded.
    """
    if number < video.info.frames:
        onwards = video.frames(number)
        first = next(onwards, None)
        if first is not None and first.number == number:
            return first, onwards
    return video.frame(number), video.frames(number + 1)


def _begun(
    video: Video, boxes: StartBoxes, markers: tuple[str, ...], method: TrackerName
) -> tuple[MarkerTracker | PlainCsrt, Sighting, Iterator[Frame]]:
    """A tracker in the frame of the boxes, what it sees there, and the frames after it."""
    frame, onwards = _from_boxes(video, boxes.frame)
    if method == "csrt":
        corners = np.array([boxes.boxes[name] for name in markers])  # (m, 4)
        baseline = PlainCsrt(frame.luma, corners[:, :2], corners[:, 2:], video.threads)
        return baseline, baseline.first, onwards
    chosen = [boxes.boxes[name] for name in markers]
    centre = np.array([box.centre_px for box in chosen])
    side = np.array([(box.width + box.height) / 2 for box in chosen])
    tracker, first = MarkerTracker.begin(frame.luma, centre, side, method == "hybrid", threads=video.threads)
    empty = without_marker(tracker, first)
    if empty.any():
        names = ", ".join(np.array(markers)[empty].tolist())
        expected = f"a disc that differs from what is around it by {LEAST_CONTRAST:g} of 255 or more"
        step = "Look at the preview of the boxes, or click them: `calib track SESSION --click`."
        file, where = str(video.info.file), f"frame {boxes.frame}"
        raise InputError([Fault(file, where, "boxes without a marker", names, expected, next_step=step)])
    return tracker, first, onwards


def _follow(
    video: Video,
    frames: Iterable[Frame],
    tracker: MarkerTracker | PlainCsrt,
    record: _Record,
    partial: Partial | None,
    progress: Progress | None,
) -> None:
    """The pass over the frames; what was tracked is kept now and then, and when it is interrupted."""
    began, first, told = time.perf_counter(), record.end, -np.inf
    since = np.diff(video.info.time_s, prepend=np.nan) * video.info.fps  # frames of the usual rate
    last = first - 1
    snapshot: dict[str, np.ndarray] = {}
    taken = written = first  # the last snapshot, and the last one written
    try:
        for frame in frames:
            elapsed = float(since[last + 1 : frame.number + 1].sum())
            record.add(frame.number, tracker.step(frame.luma, frames=elapsed))
            last = frame.number
            if partial is not None and isinstance(tracker, MarkerTracker):
                if record.end - taken >= _SNAPSHOT_EVERY and tracker.can_be_kept:
                    snapshot, taken = record.arrays() | tracker.state(), record.end
                if taken - written >= _KEEP_EVERY:
                    partial.write(snapshot)
                    written = taken
            if progress is not None and (now := time.perf_counter()) - told > _TELL_EVERY_S:
                told = now
                progress(record.end, len(record.state), (record.end - first) / (now - began))
    except KeyboardInterrupt:
        if partial is not None and snapshot:
            partial.write(snapshot)
        raise
    if partial is not None:
        partial.remove()


def _result(video: Video, markers: tuple[str, ...], record: _Record) -> TrackedTrial:
    tracks = Tracks(markers, video.info.time_s, record.position_px, record.confidence)
    flags = list(only_csrt_flags(record.by_csrt, markers))
    flags += [Flag("damaged_video", (), span, "the video is damaged here") for span in stretches(video.suspect)]
    caveats = [caveat for caveat in video.info.caveats if caveat != video.info.damage]
    flags += [Flag("damaged_video", (), None, caveat) for caveat in (*caveats, video.damage) if caveat]
    return TrackedTrial(tracks, record.state, record.size_px, tuple(flags))
