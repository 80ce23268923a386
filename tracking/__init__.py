"""From videos and tracks to marker positions one can trust: track quality and the head-frame normaliser."""

from tracking.camera import to_pool
from tracking.normaliser import HeadFrame, from_head_frame, one_of, to_head_frame
from tracking.quality import TrackQuality, check_tracks

__all__ = [
    "HeadFrame",
    "TrackQuality",
    "check_tracks",
    "from_head_frame",
    "one_of",
    "to_head_frame",
    "to_pool",
]
