"""What a body hardly changes: the distance of a marker to its neighbours, and where they put it."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

_RELATIVE = 0.15  # by which a distance may differ from that in the start boxes: tails bend, heights are in perspective
_LEAST = 0.6  # diameters that it may differ in any case
_MOVES, _ALIKE = 0.1, 0.25  # both markers swim: one moves so many diameters a frame, the other that share of it
_FEWEST, _ZOOM = 3, 1.02  # distances that tell of a common scale, and by how much it may change in a frame
_KEEP = 0.9  # of where two neighbours put a marker, frame by frame


@dataclass(eq=False)
class Spacing:
    """The markers as a tree, each joined to its nearest, and each with two nearby markers as its guides."""

    pairs: np.ndarray  # (e, 2) which are joined
    lengths: np.ndarray  # (2, e) the least and the most that they were apart, px
    guides: np.ndarray  # (m, 2) two markers near each; (0, 2) where none is joined to another
    ratios: np.ndarray  # (m,) complex place of each marker between its guides: 0 on the first, 1 on the second

    @classmethod
    def begin(cls, position_px: np.ndarray, one_body: bool = True) -> "Spacing":
        """That of markers at (m, 2) in the frame of the boxes; none is joined if each moves for itself."""
        distance = np.linalg.norm(position_px[:, None] - position_px[None], axis=2)
        tree = minimum_spanning_tree(distance).tocoo()
        joined = slice(None if one_body and len(position_px) > 2 else 0)
        pairs, lengths = np.column_stack([tree.row, tree.col])[joined], np.tile(tree.data[joined], (2, 1))
        guides = np.argsort(distance, axis=1, kind="stable")[:, 1:3][: len(position_px) if len(pairs) else 0]
        return cls(pairs, lengths, guides, _between(position_px, guides))

    def misplaced(
        self,
        position_px: np.ndarray,
        predicted_px: np.ndarray,
        moved_px: np.ndarray,
        seen: np.ndarray,
        strength: np.ndarray,
        diameter_px: np.ndarray,
    ) -> np.ndarray:
        """(m,) bool, the markers, of those seen at (m, 2), that broke away from a neighbour.

        Of two that are too close or too far apart it is the one without another neighbour to speak for it; if neither
        has one, that of less strength (m,). If both have, it is the body that moved. Two that both swim may be as far
        apart as they are predicted to be, (m, 2), and from then on; a marker that stays where it is, (m, 2) moved
        since the last frame, may sit on a glint, unless a third stays with it.
        """
        misplaced = np.zeros(len(seen), bool)
        both = seen[self.pairs].all(axis=1)
        self._rescale(_lengths(position_px, self.pairs), both)
        off = both & self._off(position_px, predicted_px, moved_px, both, diameter_px, seen)
        if not off.any():
            return misplaced
        speaking = np.bincount(self.pairs[both & ~off].ravel(), minlength=len(seen))  # neighbours for each marker
        for first, second in self.pairs[off].tolist():
            if speaking[first] and speaking[second]:
                continue
            one_sided = bool(speaking[first]) != bool(speaking[second])
            weaker = speaking[first] < speaking[second] if one_sided else strength[first] < strength[second]
            misplaced[first if weaker else second] = True
        return misplaced

    def _rescale(self, length_px: np.ndarray, both: np.ndarray) -> None:
        """All distances grow or shrink with most of those (e,) that are seen: the robot comes nearer, or dives."""
        if np.count_nonzero(both) >= _FEWEST:
            beyond = length_px[both] / np.clip(length_px[both], *self.lengths[:, both])
            self.lengths = self.lengths * np.clip(np.median(beyond), 1 / _ZOOM, _ZOOM)

    def _off(
        self,
        position_px: np.ndarray,
        predicted_px: np.ndarray,
        moved_px: np.ndarray,
        both: np.ndarray,
        diameter_px: np.ndarray,
        seen: np.ndarray,
    ) -> np.ndarray:
        """(e,) bool, the pairs too close or too far apart; learns how far those may be that both (e,) are seen."""
        larger, (least, most) = diameter_px[self.pairs].max(axis=1), self.lengths
        swim = self._swimming(np.linalg.norm(moved_px, axis=1), larger, both, seen)
        length, foreseen = _lengths(position_px, self.pairs), _lengths(predicted_px, self.pairs)
        low, high = np.where(swim, [np.minimum(least, foreseen), np.maximum(most, foreseen)], self.lengths)
        off: np.ndarray = length < low - np.maximum(_LEAST * larger, _RELATIVE * low)
        off |= length > high + np.maximum(_LEAST * larger, _RELATIVE * high)
        within = [np.minimum(least, length), np.maximum(most, length)]
        self.lengths = np.where(both & swim & ~off, within, self.lengths)
        return off

    def _swimming(self, moved_px: np.ndarray, larger_px: np.ndarray, both: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """(e,) bool, the pairs whose distance may change: both move; one does and the other rests with a third; or one
        alone moves of all that are seen (m,).
        """
        speeds = moved_px[self.pairs]
        slow, fast = speeds.min(axis=1), speeds.max(axis=1)
        moving = fast > _MOVES * larger_px
        swim: np.ndarray = moving & (slow > _ALIKE * fast)
        for pair in np.flatnonzero(moving & ~swim & both).tolist():
            resting, mover = self.pairs[pair][np.argsort(speeds[pair])]
            with_it = self.pairs[both & (self.pairs == resting).any(axis=1)]
            others = with_it[(with_it != resting) & (with_it != mover)]
            rest = seen & (moved_px <= _ALIKE * fast[pair])
            alone = np.count_nonzero(seen & ~rest) == 1 and np.count_nonzero(rest) > 1
            swim[pair] = alone or bool(rest[others].any())
        return swim

    def expected(self, position_px: np.ndarray) -> np.ndarray:
        """(m, 2) where its two guides put each marker, moved and turned with them since it was last seen well."""
        if not len(self.guides):
            return position_px.copy()
        plane = position_px @ np.array([1, 1j])
        a, b = plane[self.guides.T]
        place = a + self.ratios * (b - a)
        return np.stack([place.real, place.imag], axis=1)

    def learn(self, position_px: np.ndarray, sure: np.ndarray) -> None:
        """Takes in a frame: (m, 2) positions, and (m,) bool which of them were seen well."""
        if len(self.guides):
            known = sure & sure[self.guides].all(axis=1)
            mixed = _KEEP * self.ratios + (1 - _KEEP) * _between(position_px, self.guides)
            self.ratios = np.where(known, mixed, self.ratios)


def _lengths(position_px: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(e,) distances of pairs (e, 2) of markers at (m, 2)."""
    return np.linalg.norm(position_px[pairs[:, 0]] - position_px[pairs[:, 1]], axis=1)


def _between(position_px: np.ndarray, guides: np.ndarray) -> np.ndarray:
    """(m,) complex place of each marker between its two guides (m, 2)."""
    plane = position_px[: len(guides)] @ np.array([1, 1j])
    a, b = plane[guides.T] if len(guides) else (plane, plane)
    return (plane - a) / np.where(a == b, 1, b - a)
