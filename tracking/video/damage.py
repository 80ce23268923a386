"""What of a damaged file is lost, in words."""

from collections.abc import Iterable

import av
import numpy as np

from tracking.stretches import stretches
from tracking.video.index import AVI, FrameIndex

MP4 = "mov,mp4,m4a,3gp,3g2,mj2"
MATROSKA = "matroska,webm"
"""Names FFmpeg gives its readers of these containers."""
RANGES_SHOWN = 5
"""How many stretches of lost frames are spelled out before the rest is only counted."""
SHORT_BY_FRAMES = 2.5
"""A file may end this many frames before the duration in its header (rounding, the last frame's own duration)."""
TICKS = 1.5
"""From so many ticks a frame on, an AVI's clock is finer than its frames."""
SHORT_WITH_SOUND_S = 1.0
"""The first in seconds where sound or other streams may be longer than the picture."""


def missing_at_the_end(index: FrameIndex, container: av.container.InputContainer, stream: av.VideoStream) -> str | None:
    """What the file's header declares beyond the packets that were found; None if nothing.

    MP4 and MOV list every packet, AVI counts them, or finer ticks of a clock, Matroska and WebM give a duration,
    transport streams nothing.
    """
    found, formats = len(index.time_s), container.format.name
    last_s = float(index.time_s[-1])
    frame_s = float(np.median(np.diff(index.time_s))) if found > 1 else np.inf
    counts_ticks = formats == AVI and frame_s * float(stream.average_rate or 0) > TICKS  # with or without a frame
    declared = {AVI: stream.frames, MP4: len(stream.index_entries)}.get(formats, 0)
    if declared > index.total_packets and not counts_ticks:
        return f"the file ends after {index.total_packets} of {declared} frames, at {last_s:.3f} s"
    if (formats == MATROSKA or counts_ticks) and container.duration and found > 1:
        allowed = SHORT_BY_FRAMES * frame_s if len(container.streams) == 1 else SHORT_WITH_SOUND_S
        declared_s = container.duration / av.time_base
        if declared_s - last_s > allowed:
            expected = found + round((declared_s - last_s) / frame_s) - 1
            return f"the file ends after {found} of about {expected} frames, at {last_s:.3f} s of {declared_s:.3f} s"
    if index.broke_off:
        return f"the file cannot be read beyond frame {found - 1}, at {last_s:.3f} s"
    return None


def lost_frames(lost: Iterable[int], index: FrameIndex) -> str | None:
    """Which frames could not be decoded, and how many others that may have harmed; None if none."""
    numbers = sorted(lost)
    if not numbers:
        return None
    runs = stretches(np.isin(np.arange(len(index.time_s)), numbers))
    shown = ", ".join(_named(first, last, index) for first, last in runs[:RANGES_SHOWN])
    more = f" and {len(runs) - RANGES_SHOWN} more stretches" if len(runs) > RANGES_SHOWN else ""
    message = f"{len(numbers)} of {len(index.time_s)} frames cannot be decoded: {shown}{more}"
    harmed = int(np.sum(suspect_frames(numbers, index))) - len(numbers)
    return f"{message}; {harmed} others between the same key frames may show traces of that" if harmed else message


def suspect_frames(lost: Iterable[int], index: FrameIndex) -> np.ndarray:
    """(n,) bool, the frames that lean on a lost one, directly or not, and the lost ones themselves.

    Frames lean on each other between two key frames only, except that those shown shortly before a key frame may
    lean on it as well (an open group of pictures).
    """
    suspect = np.zeros(len(index.time_s), dtype=bool)
    for number in lost:
        first, after = index.group(number)
        if index.is_reordered and first == number > 0:
            first = index.group(number - 1)[0]
        suspect[first:after] = True
    return suspect


def _named(first: int, last: int, index: FrameIndex) -> str:
    name = f"{first}" if first == last else f"{first} to {last}"
    return f"{name} ({index.time_s[first]:.3f} s)"
