"""Markers of several hues, found again anywhere in the picture: by their hues, and by their distances at the start."""

import numpy as np

from tracking.appearance import Appearance
from tracking.colours import MarkerColours
from tracking.identities import COLOURED, FAINTER, MISSED, share_out
from tracking.spots import find_spots

_LIKELY = 0.5  # strength from which a spot may be a marker that was lost
_STRETCHES = 0.2  # share of a distance by which it usually changes: the body bends, and the camera moves
_MOST = 4.0  # the most that one distance can cost
_SURE = 1.5  # cost by which any other choice must be worse


def find_again(
    grey: np.ndarray,
    yuv: np.ndarray,
    colours: MarkerColours,
    look: Appearance,
    pairs: np.ndarray,
    apart_px: np.ndarray,
) -> np.ndarray | None:
    """Find the places (m, 2), px, of all markers in a picture, wherever they are; None where these are not certain.

    They are certain where each marker has a spot like itself, and any other choice of spots is clearly worse.

    Args:
        grey: (h, w) uint8, in which the markers are sought.
        yuv: (h, w, 3) uint8 brightness and colour differences.
        colours: of the m markers.
        look: of the markers in `grey`.
        pairs: (m - 1, 2) which markers are joined to a tree.
        apart_px: (m - 1,) distances of these at the start.
    """
    height, width = grey.shape
    middle, reach = np.array([[width / 2, height / 2]]), np.array([max(width, height) / 2])
    places = np.empty((0, 2))
    for number in range(len(look.sign)):
        spots = find_spots(grey, middle, reach, look.of(np.array([number])))
        found = spots.position_px[spots.strength >= _LIKELY]
        away = np.linalg.norm(found[:, None] - places[None], axis=2).min(axis=1, initial=np.inf)
        places = np.vstack([places, found[away > look.diameter_px[number] / 2]])
    if len(places) < len(look.sign):
        return None
    own = COLOURED * np.maximum(
        colours.unlike(yuv, places, look.diameter_px), ~colours.like(yuv, places, look.diameter_px)
    )
    alone = np.hstack([own, np.full((len(own), 1), MISSED + FAINTER)])
    between = np.linalg.norm(places[:, None] - places[None], axis=2)
    off = (between[None] - apart_px[:, None, None]) / (_STRETCHES * apart_px[:, None, None])
    links = np.zeros((len(pairs), len(places) + 1, len(places) + 1))
    links[:, :-1, :-1] = np.minimum(off**2, _MOST)
    cost, chosen = share_out(alone, links, pairs)
    if (chosen < 0).any():
        return None
    for marker, spot in enumerate(chosen.tolist()):
        other = alone.copy()
        other[marker, spot] = np.inf
        if share_out(other, links, pairs)[0] < cost + _SURE:
            return None
    return places[chosen]
