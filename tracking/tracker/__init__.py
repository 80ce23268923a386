"""The marker tracker: spots, motion, joint assignment, CSRT as a second opinion; what it cannot be sure of it flags."""

from tracking.tracker.doubtful_boxes import doubtful_boxes
from tracking.tracker.follow_video import PREDICTED_FOR, TRACKERS, Progress, TrackerName, follow_video
from tracking.tracker.judgement import JudgementLimits, judge
from tracking.tracker.partial import Partial
from tracking.tracker.plain_csrt import PlainCsrt
from tracking.tracker.retrack import retracker
from tracking.tracker.tracker import MarkerTracker, Sighting
from tracking.tracker.trusted import trusted

__all__ = [
    "PREDICTED_FOR",
    "TRACKERS",
    "JudgementLimits",
    "MarkerTracker",
    "Partial",
    "PlainCsrt",
    "Progress",
    "Sighting",
    "TrackerName",
    "doubtful_boxes",
    "follow_video",
    "judge",
    "retracker",
    "trusted",
]
