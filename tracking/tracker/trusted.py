"""What of a tracked trial may count: seen, not flagged by the tracker's own judgement, and fit for the body's shape."""

from dataclasses import dataclass, replace

import numpy as np

from session import Flag, Tracks
from swimmer import RobotSpec
from tracking.quality import check_tracks
from tracking.records import TrackedTrial
from tracking.tracker.judgement import judge

UNTRUSTED = ("lost_marker", "drift", "size", "swap")
"""Flags of the tracker's own judgement whose samples count nowhere."""


@dataclass(frozen=True, eq=False)
class TrustedTracks:
    """A tracked trial of n frames and m markers, judged.

    Attributes:
        counting: the tracks with confidence 0 where a sample was not seen, or is flagged by the tracker's judgement.
        weight: (n, m) in [0, 1]: 0 also where `tracking.check_tracks` does not believe the sample.
        flags: of the tracker, of `judge` and of `check_tracks`, each once; frames count from the video's first.
    """

    counting: Tracks
    weight: np.ndarray
    flags: tuple[Flag, ...]


def trusted(tracked: TrackedTrial, layout: RobotSpec) -> TrustedTracks:
    """Judges a tracked trial by all there is: states, look, order along the body, shape and motion.

    Args:
        tracked: n frames of m markers, after edits and with its gaps filled.
        layout: the robot, of which only the markers are used.
    """
    names = tracked.tracks.markers
    own = [flag for flag in (*tracked.flags, *judge(tracked, layout)) if flag.kind != "gap"]
    counts = tracked.seen.copy()
    for flag in own:
        if flag.kind in UNTRUSTED and flag.frames is not None:
            counts[flag.frames[0] : flag.frames[1] + 1, [names.index(name) for name in flag.markers]] = False
    counting = replace(tracked.tracks, confidence=np.where(counts, tracked.tracks.confidence, 0.0))
    first = int(np.argmax(tracked.seen.any(axis=1)))
    quality = check_tracks(counting.since(first), layout)
    weight = np.zeros(counts.shape)
    weight[first:] = quality.weight
    flags = (*own, *(flag.later(first) for flag in quality.flags))
    return TrustedTracks(counting, weight, tuple(dict.fromkeys(flags)))
