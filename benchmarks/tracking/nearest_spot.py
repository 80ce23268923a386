"""The baseline without a model: threshold the picture around each marker and take the nearest piece."""

from collections.abc import Sequence

import cv2
import numpy as np

from session import Tracks
from tracking.boxes import StartBoxes
from tracking.records import TrackedTrial
from tracking.video import Video

_REACH_PX, _LEAST_PX = 40, 12  # around the last place; area of a piece


def track_nearest(video: Video, boxes: StartBoxes, markers: Sequence[str]) -> TrackedTrial:
    """Tracks m markers, with no prediction and no joint assignment."""
    place = boxes.centres_px(tuple(markers)).astype(float)  # (m, 2)
    position = np.full((video.info.frames, len(markers), 2), np.nan)
    dark = False
    for frame in video.frames():
        if frame.number == 0:
            height, width = frame.luma.shape
            column, row = np.clip(np.rint(place).astype(int).T, 0, [[width - 1], [height - 1]])
            dark = float(np.median(frame.luma[row, column])) < float(np.median(frame.luma))
        found = np.array([_nearest(frame.luma, each, dark=dark) for each in place])
        place = np.where(np.isfinite(found), found, place)
        position[frame.number] = found
    seen = np.isfinite(position).all(axis=2)
    return TrackedTrial.of(Tracks(tuple(markers), video.info.time_s, position, seen.astype(float)))


def _nearest(luma: np.ndarray, place: np.ndarray, *, dark: bool) -> np.ndarray:
    """(2,) middle of the nearest piece; nan without one."""
    left, top = np.maximum(np.rint(place).astype(int) - _REACH_PX, 0).tolist()
    patch = np.ascontiguousarray(luma[top : top + 2 * _REACH_PX + 1, left : left + 2 * _REACH_PX + 1])
    if patch.size == 0:
        return np.full(2, np.nan)
    kind = cv2.THRESH_BINARY_INV if dark else cv2.THRESH_BINARY
    _, pieces = cv2.threshold(patch, 0, 255, kind | cv2.THRESH_OTSU)
    _, _, stats, centres = cv2.connectedComponentsWithStats(pieces)
    good = stats[1:, cv2.CC_STAT_AREA] >= _LEAST_PX
    if not good.any():
        return np.full(2, np.nan)
    candidates = centres[1:][good] + [left, top]
    return np.asarray(candidates[np.argmin(np.linalg.norm(candidates - place, axis=1))])
