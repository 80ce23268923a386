"""Pictures that repeat the one before: a film stored at a higher frame rate than it was taken at."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import cv2
import numpy as np

REPEATS = 0.05
"""A picture that differs from the one before by less than this share of what is usual repeats it."""
MOVING = 4.0
"""Steps of luma by which the usual difference must stand out, or nothing moves and nothing can be told."""
GOES_ON = 0.3
"""After repeats a picture differs by this share of what is usual, or it was the robot that stood still."""
LONGEST = 4
"""More repeats on end are a picture that stands still, or a robot."""
USUAL_OVER = 24
"""Pictures over which the usual difference is taken."""
ROWS = 360
"""Of a picture that are compared, about."""
MARGIN_PX = 40.0
"""Around the markers within which pictures are compared."""
EDGES = 0.995
"""Quantile of the differences that is compared: what moves fills little of a picture."""
OFTEN = 0.05
"""A film repeats pictures where this share of them does, …"""
AT_LEAST = 3
"""… and so many."""


class Repeats:
    """Tells of each picture of a film, in order, whether it repeats the one before.

    Attributes:
        frames: the repeats so far after which the motion went on.
        skipped: all frames of which `repeats` said so.
    """

    def __init__(self) -> None:
        self.frames: list[int] = []
        self.skipped: set[int] = set()
        self._before: np.ndarray | None = None
        self._usual: deque[float] = deque(maxlen=USUAL_OVER)
        self._run: list[int] = []

    def state(self) -> dict[str, np.ndarray]:
        """What `restored` makes it of again, but for the last picture."""
        kept = {"repeats": self.frames, "skipped": sorted(self.skipped), "repeats_run": self._run}
        return {name: np.array(numbers, int) for name, numbers in kept.items()} | {"usual": np.array(self._usual)}

    @classmethod
    def restored(cls, kept: Mapping[str, np.ndarray]) -> Repeats:
        """From what `state` gave."""
        made = cls()
        made.frames, made.skipped = kept["repeats"].tolist(), set(kept["skipped"].tolist())
        made._run = kept["repeats_run"].tolist()
        made._usual.extend(kept["usual"].tolist())
        return made

    def repeats(self, number: int, luma: np.ndarray, around_px: np.ndarray) -> bool:
        """Whether frame `number` (h, w) repeats the one before, where the markers (m, 2) were last, px."""
        step = max(1, round(luma.shape[0] / ROWS))
        now = luma[::step, ::step].copy()
        before, self._before = self._before, now
        if before is None:
            return False
        known = around_px[np.isfinite(around_px).all(axis=1)]
        low, high = (known.min(axis=0) - MARGIN_PX, known.max(axis=0) + MARGIN_PX) if len(known) else (0, np.inf)
        (left, top), (right, bottom) = (
            np.clip(np.broadcast_to(corner, 2) / step, 0, now.shape[::-1]).astype(int) for corner in (low, high)
        )
        region = np.s_[top : max(bottom, top + 1), left : max(right, left + 1)]
        apart = cv2.absdiff(np.ascontiguousarray(now[region]), np.ascontiguousarray(before[region]))
        counts = cv2.calcHist([apart], [0], None, [256], [0, 256]).ravel()
        difference = float(np.searchsorted(np.cumsum(counts), EDGES * counts.sum()))
        usual = float(np.quantile(self._usual, 0.75)) if self._usual else 0.0
        same = difference <= REPEATS * usual if usual >= MOVING else difference == 0 and not self._usual
        if same and len(self._run) < LONGEST:
            self._run.append(number)
            self.skipped.add(number)
            return True
        if difference >= max(GOES_ON * usual, MOVING):
            self.frames += self._run
        self._run = []
        self._usual.append(difference)
        return False

    def are_many(self, frames: int) -> bool:
        """Whether so many of the frames repeat the one before that the film was taken at another rate."""
        return len(self.frames) >= max(AT_LEAST, OFTEN * frames)
