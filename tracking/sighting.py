"""Sighting of the markers in a frame: the spots found in it, which of them is whose, and where each marker is."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from tracking.appearance import Appearance
from tracking.colours import MarkerColours, chroma_at
from tracking.identities import MISSED, Prediction, price
from tracking.spots import Spots, Streaks, find_spots

_FAINT_CONFIDENCE = 0.4  # confidence that CSRT has on a marker without a spot
_UNASSIGNED = 0.5  # strength from which a spot of no marker keeps its own light


@dataclass(frozen=True, eq=False)
class Sighting:
    """View of m markers in one frame.

    Attributes:
        position_px: (m, 2) measured; where a marker is not seen, predicted.
        seen: (m,) bool, measured in this frame.
        confidence: (m,) in [0, 1]; 0 where not seen.
        diameter_px: (m,) apparent; nan where not seen.
        contrast: (m,) how far it stands out; nan where not seen.
        by_csrt: (m,) bool, only CSRT saw it.
    """

    position_px: np.ndarray
    seen: np.ndarray
    confidence: np.ndarray
    diameter_px: np.ndarray
    contrast: np.ndarray
    by_csrt: np.ndarray

    def with_csrt(self, places: Mapping[int, np.ndarray]) -> "Sighting":
        """Return the sighting with the places (2,) of some markers as CSRT has them."""
        which = np.isin(np.arange(len(self.seen)), list(places))
        position = self.position_px.copy()
        for marker, place in places.items():
            position[marker] = place
        return Sighting(
            position_px=position,
            seen=self.seen | which,
            confidence=np.where(which, _FAINT_CONFIDENCE, self.confidence),
            diameter_px=np.where(which, np.nan, self.diameter_px),
            contrast=np.where(which, np.nan, self.contrast),
            by_csrt=self.by_csrt | which,
        )


@dataclass(frozen=True, eq=False)
class Search:
    """A picture (h, w) in which markers of that look and those streaks are sought, away from places (o, 2), px.

    Where markers differ in colour, `yuv` (h, w, 3) shows those of the picture.
    """

    luma: np.ndarray
    look: Appearance
    streaks: Streaks
    taken_px: np.ndarray | None
    colours: MarkerColours | None
    yuv: np.ndarray | None

    def spots(self, predicted: Prediction) -> Spots:
        """Find the spots within the gates of a prediction."""
        spots = find_spots(self.luma, predicted.position_px, predicted.gate_px, self.look, self.streaks)
        if self.taken_px is not None:
            spots = spots.away_from(self.taken_px, 0.5 * float(self.look.diameter_px.min()))
        return replace(spots, mismatch=self.mismatch(spots.position_px))

    def mismatch(self, place_px: np.ndarray) -> np.ndarray | None:
        """Return (m, c) from 0 to 1, how much places (c, 2) have another marker's hue; None if all are alike."""
        if self.colours is None or self.yuv is None:
            return None
        return self.colours.mismatch(chroma_at(self.yuv, place_px, np.median(self.look.diameter_px, keepdims=True)))


class Assignment(NamedTuple):
    """The spots of a frame, (m,) the number of each marker's, -1 for none, where each was sought, (m,) in doubt."""

    spots: Spots
    chosen: np.ndarray
    predicted: Prediction
    doubtful: np.ndarray

    @property
    def placed(self) -> tuple[np.ndarray, np.ndarray]:
        """(m, 2) where each marker's spot is, predicted where it has none, and (m,) bool whether it has one."""
        seen = self.chosen >= 0
        position = self.predicted.position_px.copy()
        position[seen] = self.spots.position_px[self.chosen[seen]]
        return position, seen

    def others_px(self, position_px: np.ndarray, taken_px: np.ndarray | None) -> np.ndarray:
        """List (o, 2) all that holds light of its own: markers (m, 2), those of others, strong spots nobody took."""
        unassigned = self.spots.strength >= _UNASSIGNED
        unassigned[self.chosen[self.chosen >= 0]] = False
        others = np.empty((0, 2)) if taken_px is None else taken_px
        return np.vstack([position_px, self.spots.position_px[unassigned], others])


def assign(spots: Spots, predicted: Prediction) -> np.ndarray:
    """Return (m,) the number of each marker's spot, -1 for none, at the least total cost.

    The cost of a pair is the squared distance in gates plus the `price` of the spot; a pair beyond the gate is never
    made, and a marker may go without.
    """
    m, c = len(predicted.gate_px), len(spots.strength)
    distance = np.linalg.norm(predicted.position_px[:, None] - spots.position_px[None], axis=2)  # (m, c)
    cost = (distance / predicted.gate_px[:, None]) ** 2 + price(spots)
    cost = np.where(distance <= predicted.gate_px[:, None], cost, 1e6)
    alone = np.where(np.eye(m, dtype=bool), MISSED, 1e6)  # each marker's own way out
    rows, columns = linear_sum_assignment(np.hstack([cost, alone]))
    chosen = np.full(m, -1)
    chosen[rows] = np.where(columns < c, columns, -1)
    return chosen
