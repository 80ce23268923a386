"""Reading videos: every frame with its own time stamp, in order or by its number, from damaged files as well."""

from tracking.video.decoding import is_without_times
from tracking.video.frame import Frame
from tracking.video.index import TimeSource
from tracking.video.info import VideoInfo
from tracking.video.reader import Video

__all__ = ["Frame", "TimeSource", "Video", "VideoInfo", "is_without_times"]
