"""All markers of a video followed: forward and backward, resumed after an interruption, tracked again after an edit.

`follow_video` makes tracks from a video and its start boxes in one pass over the frames; `Partial` keeps on disk what
was tracked so far. `retracker` tracks one marker on from a box that a person set.

`PlainCsrt` is the baseline: one CSRT tracker a marker on the whole picture, each for itself. It believes every box it
gives, and two boxes may sit on one marker; docs/tracking.md shows the cost.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args
from zipfile import BadZipFile

import cv2
import numpy as np
import xarray as xr

from swimcal.flags import Flag
from swimcal.results import writing_whole
from swimcal.tracks import as_tracks
from tracking.appearance import Grey
from tracking.boxes import Box, StartBoxes
from tracking.colours import chroma_at, redetect
from tracking.csrt import opencv_on_one_thread
from tracking.edits import Retracker, SetBox
from tracking.find_boxes import begin_in_box, check_markers, without_marker
from tracking.harmed_frames import Repeats, stretches, unmoved_frames
from tracking.sighting import Sighting
from tracking.tracked import NO_SAMPLE, REPEATED, SampleState, as_tracked, only_csrt_flags, with_samples
from tracking.tracker import MISMATCH, MarkerTracker
from tracking.video import Frame, Video, VideoInfo, backward

# Following.
TrackerName = Literal["hybrid", "spots", "csrt"]
TRACKERS: tuple[TrackerName, ...] = get_args(TrackerName)
"""hybrid: spots, and CSRT where none answers; spots: without CSRT; csrt: plain CSRT, the baseline."""

ANEW, _TRY_EVERY = 30, 3
"""Frames behind damage in which tracking starts anew where the markers are found; of these every third is tried."""
_UNLIKE = 0.5  # confidence below which a marker is unlike itself
_MANY_LOST = 2  # markers unlike themselves, or out of order, for which the whole robot is looked for
_LOST_FOR = (
    10  # frames of that after which it is looked for first; after each attempt in vain it takes half as many more
)
_COVERED_FOR = 6
"""Where two markers were lost or unlike themselves for so many frames …"""
_BACK_FOR = (8, 24)
"""… and all but one are back for one of these numbers of frames, the robot is looked for: behind a cover a name may
have gone to what looks like a dot."""
_IN_VIEW, _GONE_FOR = 0.5, 5
"""Going back, the robot is gone where so few markers that lie in the picture are seen, for so many frames."""
PREDICTED_FOR = 12
"""Frames for which the position of an unseen marker is carried on; after that it is missing."""
_BOX = 1.3  # diameters of a marker that the side of its box is, where it is found again
_SURE = 3  # least number of surely followed markers that tell where the robot is
_SNAPSHOT_EVERY = 30  # frames at least; from the last of these interrupted work goes on
_KEEP_EVERY = 600  # frames at least; the snapshot is written then, and when the work is interrupted
_REPORT_EVERY_S = 0.2

Progress = Callable[[int, int, float], None]
"""Called with frames done, frames in all, and frames a second."""
Find = Callable[[Frame], StartBoxes | None]
"""Finds the boxes in a frame; None where they are not certain."""


def follow_video(
    video: Video,
    boxes: StartBoxes,
    markers: Sequence[str],
    method: TrackerName = "hybrid",
    partial: Partial | None = None,
    progress: Progress | None = None,
    find: Find | None = None,
) -> xr.Dataset:
    """Track the markers from the frame of their boxes to the end of the video, and back to where they come into view.

    Row k is frame k; frames that cannot be read, or repeat the one before, hold no samples. Interrupted, it leaves what
    was tracked so far in `partial` and goes on from there the next time, with the same result. Behind damage it starts
    anew from the boxes that `find` finds there.

    CSRT takes as many threads as the video is decoded with; `progress` is called now and then.

    Raises:
        InputError: the frame of the boxes is not in the video, or a box holds no marker.
        ValueError: an unknown method.
    """
    if method not in TRACKERS:
        raise ValueError(f"no tracker {method!r}; choices: {', '.join(TRACKERS)}")
    with opencv_on_one_thread():
        one_pass = _Pass(video, tuple(markers), partial)
        if method == "csrt" or not one_pass.taken_up():
            one_pass.begin(boxes, method)
        one_pass.follow(progress, find)
        if method != "csrt":
            one_pass.go_back(boxes, method)
    return one_pass.result()


class _Pass:
    """One pass over the frames of a video, which can be interrupted and taken up again."""

    def __init__(self, video: Video, markers: tuple[str, ...], partial: Partial | None) -> None:
        self._video, self._markers, self._partial = video, markers, partial
        self._samples = np.full((video.info.frames, len(markers)), NO_SAMPLE)
        self._unseen = np.zeros(len(markers), int)  # number of frames without any sight of it, up to now
        self._unlike = np.zeros(len(markers), int)  # number of frames in which it was unlike itself, or out of order
        self._patience = _LOST_FOR  # number of such frames until the robot is looked for
        self._lost_at_once = 0  # markers that were lost or unlike themselves together
        self._back_for = 0  # frames since all but one are back
        self._repeats = Repeats()
        self._end = 0  # one past the last frame taken in
        self._last, self._anew = -1, 0  # the last frame taken in; for how many more it may start anew
        self._tracker: MarkerTracker | PlainCsrt
        self._grey = Grey()
        self._onwards: Iterable[Frame] = ()

    def taken_up(self) -> bool:
        """Tell whether there is interrupted work, which then goes on."""
        kept = self._partial.read() if self._partial is not None else None
        if kept is None or "samples" not in kept:
            return False
        self._tracker = MarkerTracker.restored(kept, self._video.threads)
        self._end, self._unseen, self._unlike = len(kept["samples"]), kept["frames_unseen"], kept["frames_unlike"]
        self._patience, self._lost_at_once, self._back_for = kept["patience"].tolist()
        self._samples[: self._end] = kept["samples"]
        self._grey = Grey.restored(kept["grey"])
        self._last = self._end - 1
        self._repeats = Repeats.restored(kept)
        self._onwards = self._video.frames(self._end)
        return True

    def begin(self, boxes: StartBoxes, method: TrackerName) -> None:
        """Start in the frame of the boxes, which is decoded in one go with those after it.

        Raises:
            InputError: there is no such frame, it cannot be decoded, or a box holds no marker.
        """
        onwards = self._video.frames(boxes.frame) if boxes.frame < self._video.info.frames else iter(())
        frame = next(onwards, None)
        if frame is None or frame.number != boxes.frame:
            frame, onwards = self._video.frame(boxes.frame), self._video.frames(boxes.frame + 1)
        self._onwards = onwards
        if method == "csrt":
            corners = np.array([boxes.boxes[name] for name in self._markers])  # (m, 4)
            self._tracker = PlainCsrt(frame.luma, corners[:, :2], corners[:, 2:], self._video.threads)
            first = self._tracker.first
        else:
            tracker, first = self._begun(frame, boxes, method == "hybrid")
            check_markers(str(self._video.info.file), self._grey.of(frame), boxes, self._markers, tracker, first)
        self._add(boxes.frame, first)
        self._last = boxes.frame
        self._repeats.repeats(boxes.frame, frame.luma, first.position_px)

    def _begun(self, frame: Frame, boxes: StartBoxes, use_csrt: bool) -> tuple[MarkerTracker, Sighting]:
        """Begin a tracker in a frame in which every marker has a box; return it and what it saw there."""
        centre, side = boxes.centres_px(self._markers), boxes.sides_px(self._markers)
        self._grey = Grey.of_boxes(frame, boxes, self._markers)
        self._tracker, first = MarkerTracker.begin(
            self._grey.of(frame),
            centre,
            side,
            use_csrt,
            threads=self._video.threads,
            brightness=self._grey.brightness_beside(frame),
            yuv=frame.yuv(),
        )
        return self._tracker, first

    def go_back(self, boxes: StartBoxes, method: TrackerName) -> None:
        """Go back from the frame of the boxes, to where most markers are out of sight: the robot came into view."""
        if boxes.frame == 0:
            return
        self._begun(self._video.frame(boxes.frame), boxes, method == "hybrid")
        self._unseen[:] = self._unlike[:] = 0
        gone, since, end = 0, boxes.frame, self._end
        for earlier in backward(self._video, boxes.frame):
            sighting = self._step(earlier, float(since - earlier.number))
            since = earlier.number
            self._add(earlier.number, sighting)
            height, width = earlier.luma.shape
            place = sighting.position_px
            inside = ((place >= 0) & (place < [width, height])).all(axis=1) | sighting.seen
            gone = 0 if inside.any() and sighting.seen[inside].mean() > _IN_VIEW else gone + 1
            if gone == _GONE_FOR:
                self._samples[earlier.number : earlier.number + gone] = NO_SAMPLE
                break
        self._end = end

    def _start_anew(self, frame: Frame, find: Find | None, most_stay: bool = False) -> bool:
        """Start anew in a frame where all boxes are found; return whether they are.

        Where most markers have to stay, it does so only if more than half of the boxes, but not all, are where the
        markers were last. A marker whose box is elsewhere was wrong since the doubt began: so far it was not seen. But
        boxes that leave most of the markers that were surely followed are those of another robot, and boxes in which
        markers have the hues of others are in another order.
        """
        if find is None or not isinstance(self._tracker, MarkerTracker):
            return False
        known, boxes = self._tracker.colours, find(frame) or self._by_colours(frame, self._tracker)
        if boxes is None:
            return False
        if known is not None:
            side_px = np.median(boxes.sides_px(self._markers), keepdims=True)
            chroma = chroma_at(frame.yuv(), boxes.centres_px(self._markers), side_px)
            if (known.mismatch(chroma).diagonal() >= MISMATCH).any():
                return False
        self._lost_at_once = 0
        place_px = self._samples["position_px"]
        last_px, before_px = place_px[self._last], place_px[max(self._last - 1, 0)]
        ways_px = boxes.centres_px(self._markers) - np.array([last_px, 2 * last_px - before_px])  # resting or moving on
        away_px = np.linalg.norm(ways_px, axis=2).min(axis=0)  # nan where a marker was not seen
        same, elsewhere = away_px < boxes.sides_px(self._markers), away_px >= boxes.sides_px(self._markers)
        if most_stay and (same.all() or 2 * np.count_nonzero(same) <= len(same)):
            return False
        if self._are_of_another(boxes.centres_px(self._markers), boxes.sides_px(self._markers)):
            return False
        doubted = max(int(self._unlike.max()), self._back_for)
        self._samples[max(frame.number - doubted, 0) : frame.number, elsewhere] = NO_SAMPLE
        tracker, first = self._begun(frame, boxes, self._tracker.csrt is not None)
        tracker.colours = known  # as in the boxes that a person looked at
        self._add(frame.number, first)
        return True

    def _by_colours(self, frame: Frame, tracker: MarkerTracker) -> StartBoxes | None:
        """Find boxes by the colours of the markers; None where these are alike or not certain."""
        if tracker.colours is None:
            return None
        spacing = tracker.spacing.pairs, tracker.apart_px
        places = redetect(self._grey.of(frame), frame.yuv(), tracker.colours, tracker.start, *spacing)
        if places is None:
            return None
        sides = _BOX * tracker.start.diameter_px
        found = zip(self._markers, places, sides.tolist(), strict=True)
        return StartBoxes(frame.number, {name: Box.around(place, side) for name, place, side in found})

    def _are_of_another(self, centres_px: np.ndarray, sides_px: np.ndarray) -> bool:
        """Tell whether boxes leave most of the markers that are surely followed without any box, whatever its name."""
        at_px = self._samples["position_px"][self._last][self._unlike == 0]  # (s, 2)
        away_px = np.linalg.norm(at_px[:, None] - centres_px, axis=2)  # (s, m)
        bare = ~(away_px < 2 * sides_px).any(axis=1)  # they have moved on since
        return bool(len(at_px) >= _SURE and 2 * np.count_nonzero(bare) > len(at_px))

    def _take(self, frame: Frame, since: np.ndarray, find: Find | None) -> bool:
        """Record a frame; return False if it repeats the one before. `since` (n,) are frames of the usual rate."""
        number, last = frame.number, self._last
        if self._repeats.repeats(number, frame.luma, self._samples[max(last, 0)]["position_px"]):
            return False
        self._anew = ANEW if self._video.is_suspect(number) else self._anew - 1
        tried = 0 <= self._anew < ANEW and (ANEW - self._anew) % _TRY_EVERY == 1
        if np.count_nonzero(self._unlike >= self._patience) >= _MANY_LOST:
            tried, self._patience = True, self._patience * 3 // 2  # in vain it would cost more than all the rest
        uncovered = self._lost_at_once >= _MANY_LOST and self._back_for in _BACK_FOR
        if (tried or uncovered) and self._start_anew(frame, find, most_stay=not tried):
            self._anew, self._patience = 0, _LOST_FOR
            self._unlike[:] = 0
        else:
            elapsed = float(since[last + 1 : number + 1].sum())
            self._add(number, self._step(frame, elapsed))
        self._last = number
        return True

    def _step(self, frame: Frame, frames: float) -> Sighting:
        """Follow all markers into a frame, so many frames of the usual rate after the one before."""
        beside = self._grey.brightness_beside(frame)
        coloured = isinstance(self._tracker, MarkerTracker) and self._tracker.colours is not None
        yuv = frame.yuv() if coloured else None
        return self._tracker.step(self._grey.of(frame), frames=frames, brightness=beside, yuv=yuv)

    def follow(self, progress: Progress | None, find: Find | None = None) -> None:
        """Follow to the end; what was tracked is kept now and then, and when it is interrupted."""
        began, first, reported = time.perf_counter(), self._end, -np.inf
        info = self._video.info
        since = np.diff(info.time_s, prepend=np.nan) * info.fps  # frames of the usual rate
        snapshot: dict[str, np.ndarray] = {}
        taken = written = first  # the last snapshot, and the last one written
        try:
            for frame in self._onwards:
                if not self._take(frame, since, find):
                    continue
                if self._partial is not None and isinstance(self._tracker, MarkerTracker):
                    if self._end - taken >= _SNAPSHOT_EVERY and self._tracker.can_be_kept:
                        own: dict[str, np.ndarray] = {
                            "samples": self._samples[: self._end],
                            "frames_unseen": self._unseen,
                            "frames_unlike": self._unlike,
                            "patience": np.array([self._patience, self._lost_at_once, self._back_for]),
                            "grey": self._grey.as_array(),
                        }
                        own |= self._repeats.state()
                        snapshot, taken = own | self._tracker.state(), self._end
                    if taken - written >= _KEEP_EVERY:
                        self._partial.write(snapshot)
                        written = taken
                if progress is not None and (now := time.perf_counter()) - reported > _REPORT_EVERY_S:
                    reported = now
                    progress(self._end, info.frames, (self._end - first) / (now - began))
        except KeyboardInterrupt:
            if self._partial is not None and snapshot:
                self._partial.write(snapshot)
            raise
        if self._partial is not None:
            self._partial.remove()

    def _add(self, number: int, sighting: Sighting) -> None:
        self._unseen = np.where(sighting.seen, 0, self._unseen + 1)
        itself = (sighting.confidence >= _UNLIKE) & ~sighting.by_csrt
        if isinstance(self._tracker, MarkerTracker):
            itself &= ~self._tracker.out_of_order(sighting)
        self._unlike = np.where(itself, np.maximum(self._unlike - 2, 0), self._unlike + 1)
        if self._unlike.max() == 0:
            self._patience = _LOST_FOR
        if self._back_for > _BACK_FOR[-1]:
            self._lost_at_once = 0
        self._lost_at_once = max(self._lost_at_once, int(np.count_nonzero(self._unlike >= _COVERED_FOR)))
        self._back_for = self._back_for + 1 if np.count_nonzero(itself) >= len(itself) - 1 else 0
        carried = ~sighting.seen & (self._unseen <= PREDICTED_FOR)
        known = (sighting.seen | carried)[:, None]
        row = self._samples[number]
        row["position_px"], row["confidence"] = np.where(known, sighting.position_px, np.nan), sighting.confidence
        row["state"] = np.where(sighting.seen, SampleState.MEASURED, carried * SampleState.PREDICTED)
        row["size_px"], row["by_csrt"] = sighting.diameter_px, sighting.by_csrt
        self._end = number + 1

    def _repeated(self) -> list[int]:
        """List the frames that repeat the one before, of a film taken at another rate, and drop their samples."""
        if not self._repeats.are_many(self._video.info.frames):
            return []
        repeats = [*self._repeats.frames, *self._repeats.pending]
        further = unmoved_frames(self._samples["position_px"], repeats)
        self._samples[further] = NO_SAMPLE
        return sorted({*repeats, *further})

    def result(self) -> xr.Dataset:
        """Return the tracks of all frames."""
        info = self._video.info
        repeats = self._repeated()
        for number in sorted(self._repeats.skipped - set(repeats)):  # the robot rests
            self._samples[number] = self._samples[number - 1]
        flags = list(only_csrt_flags(self._samples["by_csrt"], self._markers))
        damaged = stretches(self._video.suspect)
        flags += [Flag("damaged_video", (), span, "the video is damaged here") for span in damaged]
        caveats = [caveat for caveat in info.caveats if caveat != info.damage]
        flags += [Flag("damaged_video", (), None, caveat) for caveat in (*caveats, self._video.damage) if caveat]
        if repeats:
            flags.append(_repeats_flag(len(repeats), info))
        nowhere = np.full((*self._samples.shape, 2), np.nan)
        empty = as_tracked(as_tracks(self._markers, info.time_s, nowhere, np.zeros(self._samples.shape)))
        return with_samples(empty, self._samples, tuple(flags))


def _repeats_flag(repeats: int, info: VideoInfo) -> Flag:
    rate = info.fps * (info.frames - repeats) / info.frames
    message = (
        f"{repeats} of {info.frames} pictures repeat the one before: filmed at about {rate:.3g} frames a second, "
        f"stored as {info.fps:.3g}; they are left out"
    )
    return Flag(REPEATED, (), None, message)


def retracker(video: Video) -> Retracker:
    """Make the function by which `tracking.edits.apply_edits` tracks a marker on in this video.

    The other markers stay where they are, and no spot of theirs is taken, but for those that sit where the person put
    this one: they are wrong. The marker is followed to the last frame asked for, else to the end of the video. From a
    box that holds no marker nothing is followed: those frames are missing, and a flag ``doubtful_box`` says so.
    """
    return functools.partial(_tracked_on, video)


@opencv_on_one_thread()
def _tracked_on(
    video: Video, position_px: np.ndarray, marker: int, wanted: SetBox
) -> tuple[np.ndarray, tuple[Flag, ...]]:
    after = wanted.frame + 1
    grey, tracker, first = begin_in_box(video.frame(wanted.frame), Box(*wanted.box), video.threads)
    stop = len(position_px) if wanted.until is None else wanted.until + 1
    samples = np.full(stop - after, NO_SAMPLE)
    if without_marker(tracker, first)[0]:
        message = f"the box that a person set holds no marker; {wanted.marker} is not followed from it"
        return samples, (Flag("doubtful_box", (wanted.marker,), (wanted.frame, wanted.frame), message),)
    away = np.linalg.norm(position_px[wanted.frame] - first.position_px, axis=1)  # (m,)
    believed = ~(away < 0.5 * tracker.look.diameter_px)
    believed[marker] = False
    last_s = float(video.info.time_s[wanted.frame])
    for frame in video.frames(after, stop):
        others = position_px[frame.number, believed]  # (o, 2)
        taken = others[np.isfinite(others).all(axis=1)]
        elapsed = (frame.time_s - last_s) * video.info.fps
        sighting = tracker.step(grey.of(frame), taken, elapsed, grey.brightness_beside(frame))
        last_s = frame.time_s
        if sighting.seen[0]:
            sample = sighting.position_px, sighting.confidence, SampleState.MEASURED, sighting.diameter_px
            samples[frame.number - after] = (*(np.squeeze(part) for part in sample), sighting.by_csrt[0])
    return samples, ()


# Work that was interrupted, and the baseline.


@dataclass(frozen=True)
class Partial:
    """A file for what was tracked so far.

    Attributes:
        path: of the file, an ``.npz``; it is removed once the work is done.
        fingerprint: of all that the tracks depend on; what was kept under another one is not used.
    """

    path: Path
    fingerprint: str

    def read(self) -> dict[str, np.ndarray] | None:
        """Read what was kept; None when there is nothing, or nothing that can be used."""
        try:
            with self.path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                kept = {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, KeyError, RuntimeError, BadZipFile):  # what NumPy and zipfile raise
            return None
        return kept if str(kept.pop("fingerprint", "")) == self.fingerprint else None

    def write(self, kept: Mapping[str, np.ndarray]) -> None:
        """Write what was tracked so far over what was kept before."""
        with writing_whole(self.path) as part:
            np.savez(part, allow_pickle=False, fingerprint=np.array(self.fingerprint), **kept)

    def remove(self) -> None:
        """Forget it."""
        self.path.unlink(missing_ok=True)


class PlainCsrt:
    """OpenCV's CSRT on m markers, begun on boxes with top left corners (m, 2), of widths and heights (m, 2)."""

    def __init__(self, luma: np.ndarray, corner_px: np.ndarray, side_px: np.ndarray, threads: int = 0) -> None:
        self._threads = threads
        picture = cv2.cvtColor(np.ascontiguousarray(luma), cv2.COLOR_GRAY2BGR)
        self._trackers = [cv2.TrackerCSRT.create() for _ in corner_px]
        boxes = np.rint(np.hstack([corner_px, side_px])).astype(int)
        for tracker, box in zip(self._trackers, boxes.tolist(), strict=True):
            tracker.init(picture, tuple(box))
        self.first = self._sighting([(True, box) for box in boxes.tolist()])

    def step(self, luma: np.ndarray, **_: object) -> Sighting:
        """Follow the markers into the next frame (h, w) uint8."""
        picture = cv2.cvtColor(np.ascontiguousarray(luma), cv2.COLOR_GRAY2BGR)
        with ThreadPoolExecutor(self._threads or None) as pool:
            return self._sighting(list(pool.map(lambda tracker: tracker.update(picture), self._trackers)))

    @staticmethod
    def _sighting(answers: list[tuple[bool, tuple[int, int, int, int]]]) -> Sighting:
        seen = np.array([found for found, _ in answers])
        box = np.array([box for _, box in answers], float)  # (m, 4)
        unknown = np.full(len(seen), np.nan)
        centre = box[:, :2] + (box[:, 2:] - 1) / 2
        return Sighting(centre, seen, seen.astype(float), unknown, unknown, np.zeros_like(seen))
