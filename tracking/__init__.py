"""From videos and tracks to marker positions one can trust: track quality and the head-frame normaliser."""

from tracking.camera import to_pool, undistort
from tracking.normaliser import Displacement, HeadFrame, from_head_frame, one_of, to_head_frame
from tracking.quality import QualityLimits, TrackQuality, check_tracks

__all__ = [
    "Displacement",
    "HeadFrame",
    "QualityLimits",
    "TrackQuality",
    "check_tracks",
    "from_head_frame",
    "one_of",
    "to_head_frame",
    "to_pool",
    "undistort",
]
