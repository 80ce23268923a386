"""Start boxes that hold no marker, or may hold none.

`without_marker` finds boxes in which nothing stands out: they are refused. `doubtful_boxes` flags those in which no
more stands out than on the water elsewhere, or something unlike all other markers.
"""

from collections.abc import Sequence

import numpy as np

from swimcal.flags import Flag
from tracking.appearance import Appearance, lies_within, measure_appearance
from tracking.boxes import StartBoxes
from tracking.spots import strongest_answer
from tracking.tracker import MarkerTracker, Sighting

PLACES = 400
"""Places of the picture, drawn at random, that a box is compared with."""
FEWEST = 100
"""In a picture full of boxes, with fewer of them, nothing is reported."""
COMMON = 0.01
"""Share of the places that may answer as strongly as a marker does. In rendered pools with ripple and glints no marker
had one such place, markers as bright as the water up to 4 %; of 864 boxes put on the water, 10 had 1 % or less.
"""
PAINT = "paint them white on a dark body, black or red on a bright one, all in one colour"
FEWEST_ALIKE, FAINTER = 3, 0.7
"""Where so many markers look alike, one of the other kind is doubted if its contrast is below this share of theirs."""
CLEAR = 1.5
"""Boxes' sides from any box within which nothing is compared."""
LEAST_CONTRAST = 6.0
"""Steps of brightness by which a marker must stand out in its start box."""
LEAST_CONTRAST_FAINT = 25.0
"""The same where the detector hardly answers, so that only CSRT can follow it."""


def without_marker(tracker: MarkerTracker, first: Sighting) -> np.ndarray:
    """Return (m,) bool, the boxes without a marker, of a tracker that was just begun, and what it saw first."""
    faint = tracker.faint.which if tracker.faint is not None else ~first.seen
    empty: np.ndarray = tracker.start.contrast < np.where(faint, LEAST_CONTRAST_FAINT, LEAST_CONTRAST)
    return empty | ~first.seen


def doubtful_boxes(grey: np.ndarray, boxes: StartBoxes, markers: Sequence[str]) -> tuple[Flag, ...]:
    """Flag as ``doubtful_box`` each box in which the detector answers no more than on the water elsewhere.

    The flag is for the whole trial where the marker also lies within the levels around it, or is the odd one out.

    Args:
        grey: (h, w) uint8 picture of the boxes, in the grey that they are tracked in.
        boxes: the boxes.
        markers: names of the m markers.
    """
    flags = []
    centre_px, side_px = boxes.centres_px(markers), boxes.sides_px(markers)
    within = lies_within(grey, centre_px, side_px).tolist()
    for name, share, hidden in zip(markers, _common(grey, centre_px, side_px).tolist(), within, strict=True):
        if hidden and share > COMMON:
            message = (
                f"neither brightness nor colour tells {name} from what is around it and elsewhere: its track may be of "
                f"something else. For the next film {PAINT}"
            )
            flags.append(Flag("doubtful_box", (name,), None, message))
        elif share > COMMON:
            message = (
                f"in its start box {name} stands out no more than {share:.0%} of the picture elsewhere does: "
                "is it the marker? Look at the picture of the boxes"
            )
            flags.append(Flag("doubtful_box", (name,), (boxes.frame, boxes.frame), message))
    odd = odd_one_out(measure_appearance(grey, centre_px, side_px))
    if odd is not None and not any(markers[odd] in flag.markers for flag in flags):
        message = (
            f"what is in the start box of {markers[odd]} is fainter than all other markers, and dark where they are "
            "bright or bright where they are dark: is it the body between two of them? Look at the picture of the boxes"
        )
        flags.append(Flag("doubtful_box", (markers[odd],), None, message))
    return tuple(flags)


def odd_one_out(look: Appearance) -> int | None:
    """Return the number of the one marker that is bright where all others are dark, and fainter; None without one."""
    for sign in (-1.0, 1.0):
        alone = np.flatnonzero(look.sign == sign)
        others = look.contrast[look.sign != sign]
        if len(alone) == 1 and len(others) >= FEWEST_ALIKE and look.contrast[alone[0]] < FAINTER * others.min():
            return int(alone[0])
    return None


def _common(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> np.ndarray:
    """Return (m,) the share of places elsewhere where the detector answers as in the box; 0 without places."""
    places_px = _elsewhere(grey, centre_px, CLEAR * float(np.median(side_px)))
    common = np.zeros(len(side_px))
    if len(places_px) < FEWEST:
        return common
    look = measure_appearance(grey, centre_px, side_px)
    diameter_px, reach_px = float(np.median(np.minimum(look.diameter_px, side_px))), int(np.median(side_px) / 2)
    for sign in np.unique(look.sign).tolist():
        usual = strongest_answer(grey, places_px, reach_px, sign, diameter_px)  # (p,)
        of_sign = np.flatnonzero(look.sign == sign)
        answers = strongest_answer(grey, centre_px[of_sign], reach_px, sign, diameter_px)
        common[of_sign] = (usual[None] >= answers[:, None]).mean(axis=1)
    return common


def _elsewhere(luma: np.ndarray, centre_px: np.ndarray, clear_px: float) -> np.ndarray:
    """Return (p, 2) places in the picture, away from all boxes."""
    height, width = luma.shape
    drawn = np.random.default_rng(0).uniform(0, [width - 1, height - 1], (PLACES, 2))
    return drawn[np.linalg.norm(drawn[:, None] - centre_px[None], axis=2).min(axis=1) > clear_px]
