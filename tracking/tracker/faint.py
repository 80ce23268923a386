"""Markers too faint for the spots: CSRT follows each of them all along, in a crop that moves with it.

Started anew, CSRT often takes up something else. So it is started once, on the box as it was drawn, and its crop moves
by no more than the marker does: to CSRT the marker then hardly moves at all. OpenCV cannot write down what CSRT has
learned, so a video with faint markers that is interrupted is tracked from its beginning again.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from tracking.tracker.csrt import Crop, CropTracker


class FaintMarkers:
    """CSRT on some of m markers, each for itself; its answer is checked by nobody but the distances to neighbours.

    `which` (m,) of them are faint; `starts` shows those in the frame of the boxes, whose sides are (m,) `box_px`.
    """

    def __init__(self, which: np.ndarray, starts: Sequence[Crop], box_px: np.ndarray, threads: int = 0) -> None:
        self.which, self._threads = which, threads
        sides = np.rint(box_px[which]).astype(int).tolist()
        self._trackers = [CropTracker(start, side, moves=True) for start, side in zip(starts, sides, strict=True)]

    def step(self, luma: np.ndarray) -> dict[int, np.ndarray]:
        """Where CSRT sees each of them in the next frame."""
        with ThreadPoolExecutor(self._threads or None) as pool:
            places = list(pool.map(lambda tracker: tracker.step(luma), self._trackers))
        seen = zip(np.flatnonzero(self.which).tolist(), places, strict=True)
        return {marker: place for marker, place in seen if np.isfinite(place).all()}
