"""Markers too faint for the spots: CSRT follows each of them all along, in a crop that moves with it.

Started anew, CSRT often takes up something else. So it is started once, on the box as it was drawn, and its crop moves
by no more than the marker does: to CSRT the marker then hardly moves at all. OpenCV cannot write down what CSRT has
learned; what is kept is the picture it was started with, and taken up again it is shown all frames once more.
"""

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from tracking.tracker.csrt import CROP, CropTracker
from tracking.tracker.windows import window

_FASTEST_PX = CROP // 4  # by which a crop moves in a frame at most


class _Followed:
    """A marker in its crop.

    Args:
        crop: (s, s) picture that CSRT is started with.
        corner: (2,) int, of the crop in the picture.
        place_px: (2,) of the marker.
        side_px: of its box.
    """

    def __init__(self, crop: np.ndarray, corner: np.ndarray, place_px: np.ndarray, side_px: float) -> None:
        self.start = crop, corner, place_px
        self._corner = corner
        self._tracker = CropTracker(crop, place_px - corner, round(side_px))

    def step(self, luma: np.ndarray) -> np.ndarray:
        """(2,) where CSRT sees the marker in the next frame; nan where it does not."""
        height, width = luma.shape
        column, row = (self._corner + CROP).tolist()
        place = self._tracker.update(window(luma, column, row, CROP)) + self._corner
        if np.isfinite(place).all():
            ahead = np.clip(np.rint(place - self._corner - CROP).astype(int), -_FASTEST_PX, _FASTEST_PX)
            self._corner = np.clip(self._corner + ahead, -CROP, np.array([width, height]) - 1 - CROP)
        return place


class FaintMarkers:
    """CSRT on some markers, each for itself; what it says is checked by nobody but the distances to neighbours.

    Args:
        luma: (h, w) uint8, the frame of the boxes.
        position_px: (m, 2) of all markers.
        box_px: (m,) sides of their boxes.
        which: (m,) bool, the faint ones.
        threads: on which the crops are updated side by side; 0 for all cores.
    """

    def __init__(
        self, luma: np.ndarray, position_px: np.ndarray, box_px: np.ndarray, which: np.ndarray, threads: int = 0
    ) -> None:
        self.which, self.behind = which, 0
        self._box_px, self._threads = box_px, threads
        self._followed: dict[int, _Followed] = {}
        for marker in np.flatnonzero(which).tolist():
            column, row = np.rint(position_px[marker]).astype(int).tolist()
            crop, corner = window(luma, column, row, CROP).copy(), np.array([column - CROP, row - CROP])
            self._followed[marker] = _Followed(crop, corner, position_px[marker], float(box_px[marker]))

    def state(self) -> dict[str, np.ndarray]:
        """What CSRT was started with, as arrays; of k faint markers."""
        starts, side = [each.start for each in self._followed.values()], 2 * CROP + 1
        return {
            "faint": self.which,
            "faint_boxes": self._box_px,
            "faint_crops": np.array([crop for crop, _, _ in starts], np.uint8).reshape(-1, side, side),
            "faint_corners": np.array([corner for _, corner, _ in starts], int).reshape(-1, 2),
            "faint_places": np.array([place for _, _, place in starts], float).reshape(-1, 2),
            "faint_behind": np.array(self.behind),
        }

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray], threads: int = 0) -> "FaintMarkers":
        """The markers whose `state` this was; `replay` must follow."""
        which, box_px = state["faint"], state["faint_boxes"]
        faint = cls(np.empty((0, 0), np.uint8), np.empty((0, 2)), box_px, np.zeros_like(which), threads)
        faint.which, faint.behind = which, int(state["faint_behind"])
        starts = zip(state["faint_crops"], state["faint_corners"], state["faint_places"], strict=True)
        for marker, start in zip(np.flatnonzero(which).tolist(), starts, strict=True):
            faint._followed[marker] = _Followed(*start, float(box_px[marker]))
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
            places = list(pool.map(lambda one: one.step(luma), self._followed.values()))
        seen = zip(self._followed, places, strict=True)
        return {marker: place for marker, place in seen if np.isfinite(place).all()}
