"""What is known of a video before its frames are read."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tracking.video.index import TimeSource

LONGEST_SPAN = 60
"""Frames a span for the frame rate has at most: stamps rounded to 1 ms then leave it within 0.1 %."""

SQUARE_WITHIN = 1e-3
"""Pixels whose sides differ by no more are square."""
LONG_STEP_S, LONG_STEP = 1.0, 10
"""A step in time is reported from this length on, if it is also this many times the median one …"""
STEADY, STEADY_WITHIN, STEADY_STEP = 0.95, 0.25, 2.5
"""… or, where this share of the steps is the median one to within that, from so many times the median on: part of a
Matroska file that cannot be read is passed over without a word, and shows in the time stamps only."""


@dataclass(frozen=True, eq=False)
class VideoInfo:
    """A video's size, frames and times.

    Attributes:
        width_px, height_px: of the upright picture in square pixels.
        codec: name of the codec: ``"h264"``, ``"hevc"``, ...
        time_s: (n,) time of each frame from the first one, ascending.
        time_source: where the times come from.
        rotation_deg: 0, 90, 180 or 270, by how much the stored picture is turned counterclockwise to be upright.
        pixel_aspect: width over height of a pixel as stored; frames are given in square pixels.
        damage: what opening the file showed to be missing from it; None if nothing.
    """

    file: Path
    width_px: int
    height_px: int
    codec: str
    time_s: np.ndarray
    time_source: TimeSource = TimeSource.PRESENTATION
    rotation_deg: int = 0
    pixel_aspect: float = 1.0
    damage: str | None = None

    @property
    def has_clock(self) -> bool:
        """True if the file tells when its frames were taken; else the times are those of a given or guessed rate."""
        return self.time_source is not TimeSource.FRAME_RATE

    @property
    def is_square(self) -> bool:
        """True if the stored pixels are as wide as high."""
        return abs(self.pixel_aspect - 1) <= SQUARE_WITHIN

    @property
    def frames(self) -> int:
        """How many frames the file has; `Video.frames` may give fewer if some cannot be decoded."""
        return len(self.time_s)

    @property
    def fps(self) -> float:
        """Frames a second, the median over spans of up to 60 frames; nan for a single frame."""
        span = min(self.frames - 1, LONGEST_SPAN)
        return float(span / np.median(self.time_s[span:] - self.time_s[:-span])) if span > 0 else np.nan

    @property
    def caveats(self) -> tuple[str, ...]:
        """What a reader of results from this video must know, in sentences without a full stop."""
        caveats = [self.damage] if self.damage else []
        if jump := self._jump():
            caveats.append(jump)
        if self.time_source is not TimeSource.PRESENTATION:
            caveats.append(f"the file has no times of presentation; the frames' times come from {self.time_source}")
        return tuple(caveats)

    def _jump(self) -> str | None:
        """The longest step in time where it is far beyond the usual one: frames are missing or stamps are wrong."""
        steps_s = np.diff(self.time_s)
        if not len(steps_s):
            return None
        usual_s = np.median(steps_s)
        steady = np.mean(np.abs(steps_s - usual_s) <= STEADY_WITHIN * usual_s) >= STEADY
        reported_from_s = STEADY_STEP * usual_s if steady else max(LONG_STEP_S, LONG_STEP * usual_s)
        if steps_s.max() <= reported_from_s:
            return None
        return f"time jumps by {steps_s.max():.3f} s after frame {steps_s.argmax()}"
