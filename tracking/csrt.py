"""CSRT, OpenCV's correlation tracker, as the second opinion where no spot answers.

Lukežič et al., "Discriminative Correlation Filter with Channel and Spatial Reliability", CVPR 2017. Its boxes hold
whole pixels and it reports neither how sure it is nor when it has lost its marker. With every update it converts the
whole image, so that a crop around the marker (`CropTracker`) costs half.

`SecondOpinion` asks CSRT about markers that no spot answers for, because they are faint, half covered or out of shape,
and checks its answer.

`FaintMarkers` follows with it what no spot ever answers for, each marker in a crop that moves with it. Started anew,
CSRT often takes up something else. So it is started once, on the box as it was drawn, and its crop moves by no more
than the marker does: to CSRT the marker then hardly moves at all. OpenCV cannot write down what CSRT has learned, so a
video with faint markers that is interrupted is tracked from its beginning again.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import NamedTuple

import cv2
import numpy as np

from tracking.appearance import window

CROP = 80  # half the side of the crop, pixels
_FASTEST_PX = CROP // 4  # largest step of a moving crop in a frame

_FRAMES = 4  # after a loss in which CSRT is asked; then the marker counts as hidden
_LIKENESS = 0.6  # normalised correlation with the marker's last good look that an answer must reach
_CLEAR = 0.6  # diameters around another marker in which an answer is not believed
_TEMPLATE = 0.75  # half side of what is compared, in diameters
_BOX, _SMALLEST_BOX_PX = 1.5, 21  # side of the box that CSRT starts on, in diameters; smaller boxes cost double


class Crop(NamedTuple):
    """A marker in its surroundings."""

    picture: np.ndarray  # (s, s) uint8
    corner: np.ndarray  # (2,) int, where in the whole picture it begins
    place_px: np.ndarray  # (2,) of the marker in the whole picture

    @classmethod
    def around(cls, luma: np.ndarray, place_px: np.ndarray) -> "Crop":
        """Cut the crop around a marker out of a picture (h, w)."""
        column, row = np.rint(place_px).astype(int).tolist()
        return cls(window(luma, column, row, CROP).copy(), np.array([column, row]) - CROP, place_px)


class CropTracker:
    """CSRT on one marker, in a box of `side_px` whole pixels, within a crop that moves with the marker or does not."""

    def __init__(self, start: Crop, side_px: int, moves: bool = False) -> None:
        centre = start.place_px - start.corner
        corner = np.rint(centre - (side_px - 1) / 2).astype(int)
        self._offset = centre - (corner + (side_px - 1) / 2)
        self._corner, self._moves = start.corner, moves
        self._tracker = cv2.TrackerCSRT.create()
        self._tracker.init(_colour(start.picture), (*corner.tolist(), side_px, side_px))

    def step(self, luma: np.ndarray) -> np.ndarray:
        """Return (2,) where it believes the marker to be in the next picture (h, w); nan when it gives up."""
        column, row = (self._corner + CROP).tolist()
        found, (x, y, width, height) = self._tracker.update(_colour(window(luma, column, row, CROP)))
        if not found:
            return np.full(2, np.nan)
        place = np.array([x + (width - 1) / 2, y + (height - 1) / 2]) + self._offset + self._corner
        if self._moves:
            ahead = np.clip(np.rint(place - self._corner - CROP).astype(int), -_FASTEST_PX, _FASTEST_PX)
            self._corner = np.clip(self._corner + ahead, -CROP, np.array(luma.shape[::-1]) - 1 - CROP)
        return place


@contextmanager
def opencv_on_one_thread() -> Iterator[None]:
    """Keep OpenCV from threads of its own, which would double those on which trackers run side by side.

    The setting is the whole process's, and is put back afterwards.
    """
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


class FaintMarkers:
    """CSRT on some of m markers, each for itself; its answer is checked by nobody but the distances to neighbours.

    `which` (m,) of them are faint; `starts` shows those in the frame of the boxes, whose sides are (m,) `box_px`.
    """

    def __init__(self, which: np.ndarray, starts: Sequence[Crop], box_px: np.ndarray, threads: int = 0) -> None:
        self.which, self._threads = which, threads
        sides = np.rint(box_px[which]).astype(int).tolist()
        self._trackers = [CropTracker(start, side, moves=True) for start, side in zip(starts, sides, strict=True)]

    def step(self, luma: np.ndarray) -> dict[int, np.ndarray]:
        """Return where CSRT sees each of them in the next frame."""
        with ThreadPoolExecutor(self._threads or None) as pool:
            places = list(pool.map(lambda tracker: tracker.step(luma), self._trackers))
        seen = zip(np.flatnonzero(self.which).tolist(), places, strict=True)
        return {marker: place for marker, place in seen if np.isfinite(place).all()}


class SecondOpinion:
    """Keeps each marker's last good picture, and starts CSRT on it once the marker is lost."""

    def __init__(self, threads: int = 0) -> None:
        self._threads = threads or None
        self._memory: dict[int, Crop] = {}
        self._trackers: dict[int, CropTracker] = {}
        self._asked: dict[int, int] = {}  # how often in a row, of the markers lost now

    @property
    def running(self) -> bool:
        """Return whether CSRT runs on a marker."""
        return any(0 < asked <= _FRAMES for asked in self._asked.values())

    def state(self) -> dict[str, np.ndarray]:
        """Return the pictures that it keeps of k markers, as arrays."""
        crops, side = list(self._memory.values()), 2 * CROP + 1
        return {
            "kept": np.array(list(self._memory), int),
            "asked": np.array([self._asked.get(marker, 0) for marker in self._memory], int),
            "crops": np.array([crop.picture for crop in crops], np.uint8).reshape(-1, side, side),
            "corners": np.array([crop.corner for crop in crops], int).reshape(-1, 2),
            "places": np.array([crop.place_px for crop in crops], float).reshape(-1, 2),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Restore what `state` returned."""
        rows = zip(state["kept"].tolist(), state["crops"], state["corners"], state["places"], strict=True)
        self._memory = {marker: Crop(*crop) for marker, *crop in rows}
        asked = zip(state["kept"].tolist(), state["asked"].tolist(), strict=True)
        self._asked = {marker: times for marker, times in asked if times}

    def forget(self, found: np.ndarray) -> None:
        """Stop CSRT on the markers (m,) bool that a spot answers for again."""
        for marker in np.flatnonzero(found).tolist():
            self._trackers.pop(marker, None)
            self._asked.pop(marker, None)

    def remember(self, luma: np.ndarray, position_px: np.ndarray, sure: np.ndarray) -> None:
        """Keep the picture (h, w) of the markers at (m, 2) that were seen well (m,)."""
        for marker in np.flatnonzero(sure).tolist():
            self._memory[marker] = Crop.around(luma, position_px[marker])
        self.forget(sure)

    def ask(
        self,
        luma: np.ndarray,
        lost: np.ndarray,
        diameter_px: np.ndarray,
        position_px: np.ndarray,
        taken_px: np.ndarray | None = None,
    ) -> dict[int, np.ndarray]:
        """Ask where the lost markers (m,) are, as far as the answer looks like them and lies on no other marker.

        Of two answers in one place the one nearer to where its marker was expected, (m, 2), counts; (o, 2) are places
        of further markers.
        """
        askable = [marker for marker in np.flatnonzero(lost).tolist() if marker in self._memory]
        askable = [marker for marker in askable if self._started(marker, diameter_px[marker])]
        with ThreadPoolExecutor(self._threads) as pool:
            answers = list(pool.map(lambda marker: self._trackers[marker].step(luma), askable))
        found: dict[int, np.ndarray] = {}
        there = [*position_px[~lost], *([] if taken_px is None else taken_px)]
        off = [float(np.linalg.norm(answer - position_px[k])) for k, answer in zip(askable, answers, strict=True)]
        for _, marker, answer in sorted(zip(off, askable, answers, strict=True), key=lambda item: item[:2]):
            free = all(np.linalg.norm(place - answer) >= _CLEAR * diameter_px[marker] for place in there)
            if np.isfinite(answer).all() and free and self._likeness(luma, marker, answer, diameter_px[marker]):
                found[marker] = answer
                there.append(answer)
        return found

    def _started(self, marker: int, diameter_px: float) -> bool:
        """Tell whether CSRT runs on the marker, started now if need be; no longer once it was asked a few times."""
        asked = self._asked[marker] = self._asked.get(marker, 0) + 1
        if asked > _FRAMES:
            self._trackers.pop(marker, None)
            return False
        if marker not in self._trackers:
            side_px = max(round(_BOX * float(diameter_px)), _SMALLEST_BOX_PX)
            self._trackers[marker] = CropTracker(self._memory[marker], side_px)
        return True

    def _likeness(self, luma: np.ndarray, marker: int, answer: np.ndarray, diameter_px: float) -> bool:
        memory, reach = self._memory[marker], int(np.ceil(_TEMPLATE * diameter_px))
        column, row = np.rint(memory.place_px - memory.corner).astype(int).tolist()
        template = window(memory.picture, column, row, reach)
        column, row = np.rint(answer).astype(int).tolist()
        found = window(luma, column, row, reach)
        return float(cv2.matchTemplate(found.copy(), template.copy(), cv2.TM_CCOEFF_NORMED)[0, 0]) >= _LIKENESS


def _colour(picture: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(np.ascontiguousarray(picture), cv2.COLOR_GRAY2BGR)
