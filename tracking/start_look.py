"""Look of the markers in their start boxes, which may lie beside their markers, or hold more than these."""

from dataclasses import replace

import numpy as np

from tracking.appearance import (
    ENOUGH,
    FEWEST_ALIKE,
    LEAST_CONTRAST,
    Appearance,
    lies_within,
    measure_appearance,
    window,
)
from tracking.spots import Centres, find_spots, measure_centres, response_to, strongest_answer

_ANSWERS = (0.15, 1.2)  # smallest and largest answer to a marker, in parts of that to a disc
_BESIDE_PX = 2.0  # px and a diameter from a start box to its dot at most
_NOTHING = 0.15  # share of the usual contrast below which nothing in a box answers like a marker
_LIKE_MOST = 0.5  # share of the usual contrast from which a dot answers like most markers
_CLEARLY_MORE = 1.3  # times that a dot answers more strongly than what is in the box beside it
_FADED = 0.5  # share of the contrast in its box below which a marker was not measured at its place
_ODD = 1.3  # times the usual diameter from which on a box may hold more than its marker
_NO_DISC = 0.5  # answer below which that is no disc of its diameter
_CLEARER = 1.2  # times the contrast of all in the box that a marker of the usual size must have
_USUAL = 0.25  # change of ln(size) up to which a marker has the usual diameter


def look_in_boxes(
    luma: np.ndarray, centre_px: np.ndarray, box_px: np.ndarray
) -> tuple[Appearance, Centres, np.ndarray]:
    """Measure the look of the markers in their boxes; return it, their centres, and how wide (m,) they are at most."""
    look, centres = _refined(luma, centre_px, measure_appearance(luma, centre_px, box_px), box_px)
    common = look.sign == np.sign(look.sign.sum())
    usual_px = float(np.median(look.diameter_px[common])) if np.count_nonzero(common) >= FEWEST_ALIKE else np.inf
    odd = common & (look.diameter_px > _ODD * usual_px) & (usual_px < box_px)
    if odd.any():  # the box holds more than the marker: is there one of the usual size in it?
        tight = replace(look, diameter_px=np.where(odd, usual_px, look.diameter_px))
        again, there = _refined(luma, centre_px, tight, box_px)
        found = odd & (np.abs(np.log(again.diameter_px / usual_px)) < _USUAL)
        found &= again.contrast > _FADED * np.median(look.contrast[common])
        no_disc = with_answer(luma, centres.position_px, look).answer < _NO_DISC
        found &= no_disc | (again.contrast > _CLEARER * look.contrast)
        look = Appearance(*np.where(found, again.as_array(), look.as_array()))
        place_px = np.where(found[:, None], there.position_px, centres.position_px)
        centres = replace(centres, position_px=place_px)
    return look, centres, np.maximum(box_px, look.diameter_px)


def _refined(
    luma: np.ndarray, centre_px: np.ndarray, look: Appearance, box_px: np.ndarray
) -> tuple[Appearance, Centres]:
    """Measure the markers in their boxes (m,), from a look that may hold part of a neighbour, and off their middles."""
    widest, place_px = np.maximum(box_px, look.diameter_px), centre_px
    for _ in range(2):
        centres = measure_centres(luma, place_px, place_px, look)
        faded = centres.contrast < _FADED * look.contrast  # it went off what is faint
        place_px = np.where(faded[:, None], centre_px, centres.position_px)
        look = replace(
            look,
            diameter_px=np.where(faded, look.diameter_px, np.clip(centres.diameter_px, 1.0, widest)),
            contrast=np.where(faded, look.contrast, np.maximum(centres.contrast, LEAST_CONTRAST)),
        )
    return look, replace(centres, position_px=place_px)


def with_answer(luma: np.ndarray, centre_px: np.ndarray, look: Appearance) -> Appearance:
    """Return the look with the answer of each marker at its place (k, 2), at least a part that noise cannot give."""
    answers = []
    for (column, row), sign, diameter in zip(
        np.rint(centre_px).astype(int).tolist(), look.sign, look.diameter_px, strict=True
    ):
        half = int(np.ceil(diameter)) + 1
        response = response_to(window(luma, column, row, half), sign, diameter)
        answers.append(response[half - 1 : half + 2, half - 1 : half + 2].max())
    return replace(look, answer=np.clip(np.array(answers) / look.contrast, *_ANSWERS))


def move_onto_dots(luma: np.ndarray, centre_px: np.ndarray, box_px: np.ndarray) -> np.ndarray:
    """Return the centres (k, 2) of start boxes, each that lies beside its dot moved onto the dot.

    What is in such a box is bright where most markers are dark, or dark where most are bright, or nothing; and a free
    dot like most lies hardly farther off than it is wide, and stands out more.

    Args:
        luma: (h, w) uint8 picture.
        centre_px: (k, 2) centres of the boxes.
        box_px: (k,) their mean sides.
    """
    look = measure_appearance(luma, centre_px, box_px)
    usual = 1.0 if (look.sign > 0).mean() > 0.5 else -1.0
    odd = look.sign != usual
    common = ~odd & ~lies_within(luma, centre_px, box_px)
    alike = look.of(common)
    if len(alike.sign) < FEWEST_ALIKE:
        return centre_px
    diameter, contrast = (float(np.median(each)) for each in (alike.diameter_px, alike.contrast))
    answer = strongest_answer(luma, centre_px, 1, usual, diameter)
    distinct = contrast >= ENOUGH and float(np.median(answer[common])) >= _LIKE_MOST * contrast
    empty = ~odd & (answer < _NOTHING * contrast) & distinct
    wanted = Appearance(*np.array([[usual], [diameter], [contrast], [1.0]]))
    moved = centre_px.astype(float)
    for marker in np.flatnonzero(odd | empty).tolist():
        if empty[marker]:
            own = max(float(answer[marker]), 0.0)
        else:
            own = strongest_answer(luma, centre_px[[marker]], 1, -usual, float(look.diameter_px[marker]))[0]
        spots = find_spots(luma, moved[[marker]], np.array([diameter + _BESIDE_PX]), wanted)
        spots = spots.away_from(np.delete(moved, marker, axis=0), diameter / 2)
        clear = spots.strength * contrast > max(_CLEARLY_MORE * own, _LIKE_MOST * contrast)
        if clear.any():
            away = np.where(clear, np.linalg.norm(spots.position_px - centre_px[marker], axis=1), np.inf)
            moved[marker] = spots.position_px[away.argmin()]
    return moved
