"""Plain CSRT, the baseline: one tracker a marker on the whole picture, each for itself.

It believes every box it gives, and two boxes may sit on one marker; docs/tracking.md shows the cost.
"""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np

from tracking.tracker.tracker import Sighting


class PlainCsrt:
    """OpenCV's CSRT on m markers, begun on boxes with top left corners (m, 2), of widths and heights (m, 2)."""

    def __init__(self, luma: np.ndarray, corner_px: np.ndarray, side_px: np.ndarray, threads: int = 0) -> None:
        self._threads = threads
        picture = cv2.cvtColor(np.ascontiguousarray(luma), cv2.COLOR_GRAY2BGR)
        self._trackers = [cv2.TrackerCSRT.create() for _ in corner_px]
        boxes = np.rint(np.hstack([corner_px, side_px])).astype(int)
        for tracker, box in zip(self._trackers, boxes.tolist(), strict=True):
            tracker.init(picture, tuple(box))
        self.first = self._sighting([(True, box) for box in boxes.tolist()])

    def step(self, luma: np.ndarray, *, frames: float = 1.0) -> Sighting:  # noqa: ARG002  it has no motion model
        """Takes the next frame (h, w) uint8."""
        picture = cv2.cvtColor(np.ascontiguousarray(luma), cv2.COLOR_GRAY2BGR)
        with ThreadPoolExecutor(self._threads or None) as pool:
            return self._sighting(list(pool.map(lambda tracker: tracker.update(picture), self._trackers)))

    @staticmethod
    def _sighting(answers: list[tuple[bool, tuple[int, int, int, int]]]) -> Sighting:
        seen = np.array([found for found, _ in answers])
        box = np.array([box for _, box in answers], float)  # (m, 4)
        unknown = np.full(len(seen), np.nan)
        centre = box[:, :2] + (box[:, 2:] - 1) / 2
        return Sighting(centre, seen, seen.astype(float), unknown, unknown, np.zeros_like(seen))
