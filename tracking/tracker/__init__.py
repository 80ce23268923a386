"""The marker tracker: spots, motion, joint assignment, CSRT as a second opinion; what it cannot be sure of it flags."""

from tracking.tracker.doubtful_boxes import doubtful_boxes
from tracking.tracker.follow_video import TRACKERS, TrackerName, follow_video
from tracking.tracker.grey import Grey
from tracking.tracker.judgement import exchanged_apart, trusted
from tracking.tracker.retrack import retracker
from tracking.tracker.tracker import MarkerTracker, Sighting

__all__ = [
    "TRACKERS",
    "Grey",
    "MarkerTracker",
    "Sighting",
    "TrackerName",
    "doubtful_boxes",
    "exchanged_apart",
    "follow_video",
    "retracker",
    "trusted",
]
