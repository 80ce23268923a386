"""What of a tracked trial may count: seen, not flagged by the tracker's own judgement, and fit for the body's shape."""

from dataclasses import replace

import numpy as np

from swimmer import RobotSpec
from tracking.quality import check_tracks
from tracking.records import TrackedTrial
from tracking.tracker.judgement import judge


def trusted(tracked: TrackedTrial, layout: RobotSpec) -> TrackedTrial:
    """Judges a tracked trial by all there is: states, look, order along the body, shape and motion.

    Args:
        tracked: n frames of m markers, after edits and with its gaps filled.
        layout: the robot, of which only the markers are used.

    Returns:
        The same with the flags of the tracker, of `judge` and of `check_tracks`, each once, and with its weights: 0
        where a sample does not count, or `tracking.check_tracks` does not believe it.
    """
    own = [flag for flag in (*tracked.flags, *judge(tracked, layout)) if flag.kind != "gap"]
    first = int(np.argmax(tracked.seen.any(axis=1)))
    quality = check_tracks(replace(tracked, flags=tuple(own)).counting.since(first), layout)
    weight = np.zeros(tracked.state.shape)
    weight[first:] = quality.weight
    flags = (*own, *(flag.later(first) for flag in quality.flags))
    return replace(tracked, flags=tuple(dict.fromkeys(flags)), weight=weight)
