"""Tracking one marker on from a box that a person set."""

import numpy as np

from session import Flag
from tracking.boxes import Box
from tracking.records.edit import SetBox
from tracking.records.edits import Retracker
from tracking.records.tracked import NO_SAMPLE, SampleState
from tracking.tracker.csrt import opencv_on_one_thread
from tracking.tracker.doubtful_boxes import without_marker
from tracking.tracker.grey import Grey
from tracking.tracker.tracker import MarkerTracker
from tracking.video import Video


def retracker(video: Video) -> Retracker:
    """What `tracking.records.apply_edits` asks to track a marker on in this video.

    The other markers stay where they are, and no spot of theirs is taken, but for those that sit where the person put
    this one: they are wrong. The marker is followed to the last frame asked for, else to the end of the video. From a
    box that holds no marker nothing is followed: those frames are missing, and a flag ``doubtful_box`` says so.
    """

    def retrack(position_px: np.ndarray, marker: int, wanted: SetBox) -> tuple[np.ndarray, tuple[Flag, ...]]:
        with opencv_on_one_thread():
            return _tracked_on(video, position_px, marker, wanted)

    return retrack


def _tracked_on(
    video: Video, position_px: np.ndarray, marker: int, wanted: SetBox
) -> tuple[np.ndarray, tuple[Flag, ...]]:
    box, after = Box(*wanted.box), wanted.frame + 1
    centre, side = np.array([box.centre_px]), np.array([(box.width + box.height) / 2])
    start = video.frame(wanted.frame)
    grey = Grey.chosen(start, centre, side)
    tracker, first = MarkerTracker.begin(grey.of(start), centre, side, threads=video.threads)
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
        sighting = tracker.step(grey.of(frame), taken, (frame.time_s - last_s) * video.info.fps)
        last_s = frame.time_s
        if sighting.seen[0]:
            sample = sighting.position_px, sighting.confidence, SampleState.MEASURED, sighting.diameter_px
            samples[frame.number - after] = (*(np.squeeze(part) for part in sample), sighting.by_csrt[0])
    return samples, ()
