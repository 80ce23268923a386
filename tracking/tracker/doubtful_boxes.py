"""Boxes that hold no marker: what is in them does not stand out, or no more than the water elsewhere does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from session import Flag
from tracking.boxes import StartBoxes
from tracking.tracker.appearance import measure_appearance
from tracking.tracker.spots import strongest_answer
from tracking.tracker.tracker import MarkerTracker, Sighting

PLACES = 400
"""Places of the picture, drawn at random, that a box is compared with."""
FEWEST = 100
"""With fewer, in a picture full of boxes, nothing is reported."""
COMMON = 0.01
"""Share of the places that may answer as strongly as a marker does. In rendered pools with ripple and glints no marker
had one such place, markers as bright as the water up to 4 %; of 864 boxes put on the water, 10 had 1 % or less.
"""
CLEAR = 1.5
"""Boxes' sides from any box within which nothing is compared."""
LEAST_CONTRAST = 6.0
"""Steps of brightness by which a marker must stand out in its start box."""
LEAST_CONTRAST_FAINT = 25.0
"""The same where the detector hardly answers, so that only CSRT can follow it."""


def without_marker(tracker: MarkerTracker, first: Sighting) -> np.ndarray:
    """(m,) bool, the boxes without a marker, of a tracker that was just begun, and what it saw first."""
    faint = tracker.faint.which if tracker.faint is not None else ~first.seen
    empty: np.ndarray = tracker.start.contrast < np.where(faint, LEAST_CONTRAST_FAINT, LEAST_CONTRAST)
    return empty | ~first.seen


def doubtful_boxes(grey: np.ndarray, boxes: StartBoxes, markers: Sequence[str]) -> tuple[Flag, ...]:
    """A flag ``doubtful_box`` for each box in which the detector answers no more than on the water elsewhere.

    The picture (h, w) uint8 is that of the boxes, in the grey that they are tracked in.
    """
    centre_px = boxes.centres_px(markers)
    side_px = np.array([(boxes.boxes[name].width + boxes.boxes[name].height) / 2 for name in markers])
    places_px = _elsewhere(grey, centre_px, CLEAR * float(np.median(side_px)))
    if len(places_px) < FEWEST:
        return ()
    look = measure_appearance(grey, centre_px, side_px)
    diameter_px, reach_px = float(np.median(np.minimum(look.diameter_px, side_px))), int(np.median(side_px) / 2)
    flags = []
    for sign in sorted(set(look.sign.tolist())):
        usual = strongest_answer(grey, places_px, reach_px, sign, diameter_px)  # (p,)
        of_sign = np.flatnonzero(look.sign == sign)
        answers = strongest_answer(grey, centre_px[of_sign], reach_px, sign, diameter_px)
        common = (usual[None] >= answers[:, None]).mean(axis=1)
        for k, share in zip(of_sign.tolist(), common.tolist(), strict=True):
            if share > COMMON:
                message = (
                    f"in its start box {markers[k]} stands out no more than {share:.0%} of the picture elsewhere does: "
                    "is it the marker? Look at the picture of the boxes"
                )
                flags.append(Flag("doubtful_box", (markers[k],), (boxes.frame, boxes.frame), message))
    return tuple(flags)


def _elsewhere(luma: np.ndarray, centre_px: np.ndarray, clear_px: float) -> np.ndarray:
    """(p, 2) places in the picture, away from all boxes."""
    height, width = luma.shape
    drawn = np.random.default_rng(0).uniform(0, [width - 1, height - 1], (PLACES, 2))
    return drawn[np.linalg.norm(drawn[:, None] - centre_px[None], axis=2).min(axis=1) > clear_px]
