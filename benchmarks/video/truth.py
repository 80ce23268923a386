"""Truth of a rendered clip, kept next to it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swimcal.results import writing_whole
from tracking.boxes import Box, StartBoxes

_BOX_MARGIN_PX = 3.0


@dataclass(frozen=True, eq=False)
class ClipTruth:
    """Truth of a clip of n frames with m markers; pixels have the centre of the top left one at (0, 0).

    Measure a tracker against `shown_px`: it is the centre of gravity of the marker's disc in the noiseless picture.
    `position_px` is where the marker was at the frame's time; it differs from `shown_px` by the rolling shutter and,
    where the path bends within an exposure, by motion blur.
    """

    markers: tuple[str, ...]
    time_s: np.ndarray  # (n,) times of the frames, the middle of the exposure of the middle row, s
    position_px: np.ndarray  # (n, m, 2) centre of each disc in the distorted image, in an instant at `time_s`
    shown_px: np.ndarray  # (n, m, 2) mean of that over the exposure of the marker's own row
    visible_share: np.ndarray  # (n, m) share of each disc that is in the picture with nothing above it, 0 to 1
    diameter_px: np.ndarray  # (m,) diameters of the discs

    @property
    def visible(self) -> np.ndarray:
        """(n, m) bool, True where a disc is seen whole."""
        return self.visible_share > 0.999

    def start_boxes(self) -> StartBoxes:
        """Return boxes around each marker in the first frame, in whole pixels, as drawn by hand."""
        boxes = {}
        for name, centre, diameter in zip(self.markers, self.shown_px[0], self.diameter_px, strict=True):
            size = round(float(diameter) + 2 * _BOX_MARGIN_PX)
            left, top = (round(float(c) - (size - 1) / 2) for c in centre)
            boxes[name] = Box(float(left), float(top), float(size), float(size))
        return StartBoxes(0, boxes)

    def save(self, path: Path) -> None:
        """Write the truth as .npz.

        Raises:
            swimcal.errors.ResultsNotWritable: the file cannot be written.
        """
        with writing_whole(path) as part, part.open("wb") as stream:
            np.savez_compressed(stream, **vars(self))


def load_truth(path: Path) -> ClipTruth:
    """Read the truth of a clip."""
    with np.load(path, allow_pickle=False) as stored:
        return ClipTruth(**{**stored, "markers": tuple(map(str, stored["markers"]))})


def truth_file(video: Path) -> Path:
    """Return the file of the truth of a clip: `clean.truth.npz` next to `clean.mp4`."""
    return video.with_suffix(".truth.npz")


def boxes_file(video: Path) -> Path:
    """Return the file of the start boxes of a video: `clean.boxes.json` next to `clean.mp4`."""
    return video.with_suffix(".boxes.json")
