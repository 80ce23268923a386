"""Markers too faint for the spots: CSRT follows each of them all along, in a crop that moves with it.

Started anew, CSRT often takes up something else. So it is started once, on the box as it was drawn, and its crop moves
by no more than the marker does: to CSRT the marker then hardly moves at all. OpenCV cannot write down what CSRT has
learned; what is kept is the picture it was started with, and taken up again it is shown all frames once more.
"""

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from tracking.tracker.csrt import Crop, CropTracker, as_arrays, from_arrays


class FaintMarkers:
    """CSRT on some of m markers, each for itself; what it says is checked by nobody but the distances to neighbours.

    `which` (m,) of them are faint; `starts` shows those in the frame of the boxes, whose sides are (m,) `box_px`.
    """

    def __init__(self, which: np.ndarray, starts: Sequence[Crop], box_px: np.ndarray, threads: int = 0) -> None:
        self.which, self.behind = which, 0
        self._starts, self._box_px, self._threads = starts, box_px, threads
        sides = np.rint(box_px[which]).astype(int).tolist()
        self._trackers = [CropTracker(start, side, moves=True) for start, side in zip(starts, sides, strict=True)]

    def state(self) -> dict[str, np.ndarray]:
        """What CSRT was started with, as arrays."""
        own = {"faint": self.which, "faint_boxes": self._box_px, "faint_behind": np.array(self.behind)}
        return own | as_arrays(self._starts, "faint_")

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray], threads: int = 0) -> "FaintMarkers":
        """The markers whose `state` this was; `replay` must follow."""
        faint = cls(state["faint"], from_arrays(state, "faint_"), state["faint_boxes"], threads)
        faint.behind = int(state["faint_behind"])
        return faint

    def replay(self, frames: Iterable[np.ndarray]) -> bool:
        """Shows CSRT the last `behind` frames (h, w) once more; False if there are not as many."""
        wanted, self.behind = self.behind, 0
        for luma in frames:
            self.step(luma)
        return self.behind == wanted

    def step(self, luma: np.ndarray) -> dict[int, np.ndarray]:
        """Where CSRT sees each of them in the next frame."""
        self.behind += 1
        with ThreadPoolExecutor(self._threads or None) as pool:
            places = list(pool.map(lambda tracker: tracker.step(luma), self._trackers))
        seen = zip(np.flatnonzero(self.which).tolist(), places, strict=True)
        return {marker: place for marker, place in seen if np.isfinite(place).all()}
