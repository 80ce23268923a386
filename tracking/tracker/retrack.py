"""Tracking one marker on from a box that a person set."""

import numpy as np

from tracking.boxes import Box
from tracking.records import Retrack, Retracker, SampleState, TrackedTrial
from tracking.tracker.tracker import MarkerTracker
from tracking.video import Video


def retracker(video: Video) -> Retracker:
    """What `tracking.records.apply_edits` asks to track a marker on in this video.

    The other markers stay where they are, and no spot of theirs is taken, but for those that sit where the person put
    this one: they are wrong. The marker is followed to the last frame asked for, else to the end of the video.
    """

    def retrack(tracked: TrackedTrial, wanted: Retrack) -> TrackedTrial:
        return _tracked_on(video, tracked, wanted)

    return retrack


def _tracked_on(video: Video, tracked: TrackedTrial, wanted: Retrack) -> TrackedTrial:
    marker = tracked.tracks.markers.index(wanted.marker)
    box = Box(*wanted.box)
    centre, side = np.array([box.centre_px]), np.array([(box.width + box.height) / 2])
    tracker, first = MarkerTracker.begin(video.frame(wanted.frame).luma, centre, side)
    last_s = float(video.info.time_s[wanted.frame])
    away = np.linalg.norm(tracked.tracks.position_px[wanted.frame] - first.position_px, axis=1)  # (m,)
    believed = ~(away < 0.5 * tracker.look.diameter_px)
    believed[marker] = False
    others = tracked.tracks.position_px[:, believed]  # (n, o, 2)
    position, confidence = tracked.tracks.position_px.copy(), tracked.tracks.confidence.copy()
    state, size = tracked.state.copy(), tracked.size_px.copy()
    stop = len(state) if wanted.until is None else wanted.until + 1
    for frame in video.frames(wanted.frame + 1, stop):
        row = frame.number
        taken = others[row][np.isfinite(others[row]).all(axis=1)]
        seen = tracker.step(frame.luma, taken, (frame.time_s - last_s) * video.info.fps)
        last_s = frame.time_s
        found = bool(seen.seen[0])
        position[row, marker] = seen.position_px[0] if found else np.nan
        confidence[row, marker], size[row, marker] = seen.confidence[0], seen.diameter_px[0]
        state[row, marker] = SampleState.MEASURED if found else SampleState.MISSING
    return tracked.with_samples(position, confidence, state, size, tracked.flags)
