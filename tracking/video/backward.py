"""The frames of a video in the opposite order."""

from __future__ import annotations

from collections.abc import Iterator

from tracking.video.frame import Frame
from tracking.video.reader import Video

HELD_BYTES = 2e8
"""Pictures that are held at a time, about."""


def backward(video: Video, stop: int) -> Iterator[Frame]:
    """The readable frames before frame `stop`, the last first; decoded in stretches, which are held one at a time."""
    many = max(8, int(HELD_BYTES / (1.5 * video.info.width_px * video.info.height_px)))
    while stop > 0:
        first = max(stop - many, 0)
        yield from reversed(list(video.frames(first, stop)))
        stop = first
