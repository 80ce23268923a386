"""How far tracks can be believed: each sample against the shape of the body, learned from its trial, and its motion."""

from tracking.quality.check import FLOOR_PX, TrackQuality, check_tracks

__all__ = ["FLOOR_PX", "TrackQuality", "check_tracks"]
