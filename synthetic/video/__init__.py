"""Pool videos with known truth."""

from synthetic.video.writer import Codec, VideoWriter

__all__ = ["Codec", "VideoWriter"]
