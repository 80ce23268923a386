"""Tracking one marker on from a box that a person set."""

import numpy as np

from session import Flag
from tracking.boxes import Box
from tracking.records import SampleState, TrackedTrial
from tracking.records.edits import ONLY_CSRT, Retrack, Retracker, only_csrt_flags
from tracking.tracker.opencv_threads import opencv_on_one_thread
from tracking.tracker.tracker import MarkerTracker
from tracking.tracker.without_marker import without_marker
from tracking.video import Video


def retracker(video: Video) -> Retracker:
    """What `tracking.records.apply_edits` asks to track a marker on in this video.

    The other markers stay where they are, and no spot of theirs is taken, but for those that sit where the person put
    this one: they are wrong. The marker is followed to the last frame asked for, else to the end of the video. From a
    box that holds no marker nothing is followed: those frames are missing, and a flag ``doubtful_box`` says so.
    """

    def retrack(tracked: TrackedTrial, wanted: Retrack) -> TrackedTrial:
        with opencv_on_one_thread():
            return _tracked_on(video, tracked, wanted)

    return retrack


def _tracked_on(video: Video, tracked: TrackedTrial, wanted: Retrack) -> TrackedTrial:
    marker = tracked.tracks.markers.index(wanted.marker)
    box = Box(*wanted.box)
    centre, side = np.array([box.centre_px]), np.array([(box.width + box.height) / 2])
    tracker, first = MarkerTracker.begin(video.frame(wanted.frame).luma, centre, side, threads=video.threads)
    empty = bool(without_marker(tracker, first)[0])
    last_s = float(video.info.time_s[wanted.frame])
    away = np.linalg.norm(tracked.tracks.position_px[wanted.frame] - first.position_px, axis=1)  # (m,)
    believed = ~(away < 0.5 * tracker.look.diameter_px)
    believed[marker] = False
    others = tracked.tracks.position_px[:, believed]  # (n, o, 2)
    position, confidence = tracked.tracks.position_px.copy(), tracked.tracks.confidence.copy()
    state, size = tracked.state.copy(), tracked.size_px.copy()
    by_csrt = np.zeros(state.shape, bool)
    stop = len(state) if wanted.until is None else wanted.until + 1
    ahead = slice(wanted.frame + 1, stop)
    state[ahead, marker], confidence[ahead, marker] = SampleState.MISSING, 0.0
    position[ahead, marker], size[ahead, marker] = np.nan, np.nan
    for frame in () if empty else video.frames(wanted.frame + 1, stop):
        row = frame.number
        taken = others[row][np.isfinite(others[row]).all(axis=1)]
        seen = tracker.step(frame.luma, taken, (frame.time_s - last_s) * video.info.fps)
        last_s = frame.time_s
        found = bool(seen.seen[0])
        position[row, marker] = seen.position_px[0] if found else np.nan
        confidence[row, marker], size[row, marker] = seen.confidence[0], seen.diameter_px[0]
        state[row, marker] = SampleState.MEASURED if found else SampleState.MISSING
        by_csrt[row, marker] = seen.by_csrt[0]
    kept = tuple(flag for flag in tracked.flags if flag.kind != ONLY_CSRT)
    flags = (*kept, *only_csrt_flags(by_csrt, tracked.tracks.markers), *(_doubts(wanted) if empty else ()))
    return tracked.with_samples(position, confidence, state, size, flags)


def _doubts(wanted: Retrack) -> tuple[Flag, ...]:
    message = f"the box that a person set holds no marker; {wanted.marker} is not followed from it"
    return (Flag("doubtful_box", (wanted.marker,), (wanted.frame, wanted.frame), message),)
