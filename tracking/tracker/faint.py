"""Markers too faint for the spots: CSRT follows each of them all along, in a crop that moves with it.

OpenCV cannot write down what CSRT has learned, and starting it anew loses markers. What is kept is therefore the
picture it was last started with; taken up again, it is shown the frames since then once more.
"""

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from tracking.tracker.csrt import CROP, CropTracker
from tracking.tracker.windows import window

_NEAR = CROP // 2  # pixels from the middle of its crop beyond which a marker gets a new one


class _Followed(NamedTuple):
    """A marker in its crop.

    Attributes:
        tracker: CSRT on it.
        crop: (s, s) picture that CSRT was started with.
        corner: (2,) of the crop.
        start_px, place_px: (2,) where the marker was then, and where it was last seen.
        age: frames since then.
    """

    tracker: CropTracker
    crop: np.ndarray
    corner: np.ndarray
    start_px: np.ndarray
    place_px: np.ndarray
    age: int


class FaintMarkers:
    """CSRT on some markers, each for itself; what it says is checked by nobody but the distances to neighbours.

    Args:
        luma: (h, w) uint8, the frame of the boxes.
        position_px: (m, 2) of all markers.
        diameter_px: (m,).
        which: (m,) bool, the faint ones.
        threads: on which the crops are updated side by side; 0 for all cores.
    """

    def __init__(
        self, luma: np.ndarray, position_px: np.ndarray, diameter_px: np.ndarray, which: np.ndarray, threads: int = 0
    ) -> None:
        self.which = which
        self._diameter_px, self._threads = diameter_px, threads
        markers = np.flatnonzero(which).tolist()
        self._followed = {marker: self._started(luma, marker, position_px[marker]) for marker in markers}

    @property
    def behind(self) -> int:
        """How many of the last frames CSRT was shown on the marker that it was started on first."""
        return max((each.age for each in self._followed.values()), default=0)

    def state(self) -> dict[str, np.ndarray]:
        """What CSRT was last started with, as arrays; of k faint markers."""
        kept, side = list(self._followed.values()), 2 * CROP + 1
        return {
            "faint": self.which,
            "faint_diameters": self._diameter_px,
            "faint_crops": np.array([each.crop for each in kept], np.uint8).reshape(-1, side, side),
            "faint_corners": np.array([each.corner for each in kept], int).reshape(-1, 2),
            "faint_starts": np.array([each.start_px for each in kept], float).reshape(-1, 2),
            "faint_places": np.array([each.place_px for each in kept], float).reshape(-1, 2),
            "faint_ages": np.array([each.age for each in kept], int),
        }

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray], threads: int = 0) -> "FaintMarkers":
        """The markers whose `state` this was; `replay` must follow."""
        nobody, no_picture = np.zeros_like(state["faint"]), np.empty((0, 0), np.uint8)
        faint = cls(no_picture, np.empty((0, 2)), state["faint_diameters"], nobody, threads)
        faint.which = state["faint"]
        columns = (state[f"faint_{name}"] for name in ("crops", "corners", "starts", "places", "ages"))
        for marker, crop, corner, start, place, age in zip(np.flatnonzero(faint.which).tolist(), *columns, strict=True):
            one = faint._in_crop(marker, crop, corner, start)
            faint._followed[marker] = one._replace(place_px=place, age=int(age))
        return faint

    def replay(self, frames: Iterable[np.ndarray]) -> bool:
        """Shows CSRT the last `behind` frames (h, w) once more; False if there are not as many."""
        left = self.behind
        for luma in frames:
            for one in self._followed.values():
                if one.age >= left > 0:
                    _updated(luma, one)
            left -= 1
        return left == 0

    def step(self, luma: np.ndarray) -> dict[int, np.ndarray]:
        """Where CSRT sees each of them in the next frame."""
        with ThreadPoolExecutor(self._threads or None) as pool:
            places = list(pool.map(lambda one: _updated(luma, one), self._followed.values()))
        found: dict[int, np.ndarray] = {}
        for (marker, one), place in zip(list(self._followed.items()), places, strict=True):
            if np.isfinite(place).all():
                found[marker] = place
            one = one._replace(place_px=found.get(marker, one.place_px), age=one.age + 1)
            far = np.abs(one.place_px - one.corner - CROP).max() > _NEAR
            self._followed[marker] = self._started(luma, marker, one.place_px) if far else one
        return found

    def _started(self, luma: np.ndarray, marker: int, place_px: np.ndarray) -> _Followed:
        column, row = np.rint(place_px).astype(int).tolist()
        crop = window(luma, column, row, CROP).copy()
        return self._in_crop(marker, crop, np.array([column - CROP, row - CROP]), place_px)

    def _in_crop(self, marker: int, crop: np.ndarray, corner: np.ndarray, place_px: np.ndarray) -> _Followed:
        tracker = CropTracker(crop, place_px - corner, float(self._diameter_px[marker]))
        return _Followed(tracker, crop, corner, place_px, place_px, 0)


def _updated(luma: np.ndarray, one: _Followed) -> np.ndarray:
    column, row = (one.corner + CROP).tolist()
    return one.tracker.update(window(luma, column, row, CROP)) + one.corner
