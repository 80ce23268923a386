"""Motion and identities: where each marker is expected in the next frame, and which spot is which marker.

`MarkerMotion` carries each marker on, and tells how far off that may be. `Spacing` knows what a body hardly changes:
the distance of a marker to its neighbours, and where they put it.

`assemble_markers` assigns the spots of a frame to all markers at once, where the nearest spot need not be the right
one. Markers are joined to a tree, each to its nearest. A choice of spots costs the departure of each marker from its
expected place, the departure of each link of the tree from its length and direction so far, and a price for each marker
without a spot. The least cost over a tree is found exactly by dynamic programming from its leaves (Felzenszwalb and
Huttenlocher, Pictorial structures for object recognition, IJCV 61, 2005, section 3). Where two markers would share a
spot, each of them is tried without it. A shift of the whole body costs little: the sum is also tried with all markers
shifted by what a marker at an end of the tree may have moved.
"""

from dataclasses import dataclass
from functools import lru_cache
from heapq import heappop, heappush
from itertools import count
from typing import NamedTuple

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

from tracking.spots import Spots

_MEMORY = 3  # frames that the motion is carried on from
_PAST_SPREAD = 3.0  # the gate holds this many typical errors of the predictions so far
_FORGET = 0.95  # share of a typical error that is kept, frame by frame
_GROWTH = 0.35  # relative growth of the gate with every frame a marker was not seen
_FADE = 0.7  # share of the velocity kept with every frame a marker was not seen
_WIDEST = 5.0  # the gate never exceeds this many diameters
_FIRST = 1.5, 0.5  # the first gates: diameters at least, and the share of the way to the nearest marker
_KEEP_BEAT = 0.98  # share of the known beat that is kept, frame by frame
_BEAT = 0.002, 2 * np.pi / 8  # slowest and fastest, rad a frame; slower ones are parabolas

# `Spacing`.
_RELATIVE = 0.15  # relative change of a distance since the start boxes: tails bend, heights differ
_LEAST = 0.6  # diameters that it may differ in any case
_MOVES, _ALIKE = 0.1, 0.25  # both markers swim: one moves so many diameters a frame, the other that share of it
_FEWEST, _ZOOM = 3, 1.02  # distances that tell of a common scale, and by how much it may change in a frame
_KEEP = 0.9  # share kept, frame by frame, of where two neighbours put a marker

NOWHERE_PX = 1e-3
"""A gate, px, that no spot passes."""

# `assemble_markers`: prices and standard deviations.
MISSED = 2.0
"""The price of leaving a marker without a spot."""
FAINTER = 1.0
"""The price of a spot of no strength."""
OTHER_HUE = 4.0
"""The price of a spot in the hue of another marker: more than that of none."""
_STIFF, _STIFF_PX = 0.15, 1.5  # standard deviation of a link's length: a share of it, and px of the start boxes
_TURN_RAD = 0.6  # standard deviation of a link's direction about the one predicted
_LINK = 2.5  # the most that one link can cost: bodies bend more than they did so far
_UNSEEN = 0.4  # weight of a link to a marker without a spot
_SHIFT = 0.3  # the price of a shift of the body by the usual distance of its markers
_SHIFTS = 12  # tried at most, the likeliest first
_SOLVED = 40  # solutions tried at most until no spot is used twice
_NEVER = 1e6


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where to look for m markers."""

    position_px: np.ndarray  # (m, 2)
    gate_px: np.ndarray  # (m,) how far from there a spot may be
    velocity_px: np.ndarray  # (m, 2) a frame, there

    @property
    def is_open(self) -> np.ndarray:
        """(m,) bool, the markers that spots are sought for."""
        return self.gate_px > NOWHERE_PX


@dataclass(eq=False)
class MarkerMotion:
    """The recent motion of m markers.

    A marker seen in the last three frames is carried on along the constant and sine through them, at the one frequency
    of all markers. In equal steps its velocities follow v[k+1] = 2 cos(beat) v[k] - v[k-1], of which least squares over
    the frames so far give the beat; a beat of 0 is the parabola. A marker that was not seen moves with the two nearest
    markers that were, as if the three were one rigid piece, and its own velocity relative to them fades.
    """

    past: np.ndarray  # (3, m, 2) where each marker was or was thought to be, px, newest first
    times: np.ndarray  # (3,) of these, in frames
    unseen: np.ndarray  # (m,) for how many frames in a row each marker has not been seen
    seen: np.ndarray  # (m,) for how many it has been, up to 3
    error_px: np.ndarray  # (m,) typical, of predictions
    beat: np.ndarray  # (2,) sums over the past, of v[k] (v[k+1] + v[k-1]) and of v[k]^2

    @classmethod
    def begin(cls, position_px: np.ndarray, diameter_px: np.ndarray) -> "MarkerMotion":
        """Start the motion of markers of (m,) diameters at (m, 2) in the first frame."""
        m = len(position_px)
        past = np.repeat(position_px[None].astype(float), _MEMORY, axis=0)
        return cls(past, np.array([0.0, -1.0, -2.0]), np.zeros(m, int), np.ones(m, int), 0.5 * diameter_px, np.zeros(2))

    def predict(self, diameter_px: np.ndarray, frames: float = 1.0) -> Prediction:
        """Predict where to look after so many frames; the gate grows with the errors and while a marker is unseen."""
        angles = self._beat_rad * self.times, self._beat_rad * frames
        past, then = (np.array([np.ones_like(t), np.cos(t), np.sin(t)]) for t in angles)
        weights = np.linalg.solve(past, then)  # (3,) of the constant and sine through three places
        steady = (weights @ self.past.reshape(_MEMORY, -1)).reshape(-1, 2)
        position = np.where((self.seen >= _MEMORY)[:, None], steady, self.past[0])
        velocity = (self.past[0] - self.past[1]) * frames / (self.times[0] - self.times[1])
        position = np.where((self.seen == 2)[:, None], self.past[0] + velocity, position)
        lost = self.unseen > 0
        if lost.any():
            position[lost] = self._with_neighbours(position, lost, velocity)[lost]
        gate = np.maximum(0.5 * diameter_px, _PAST_SPREAD * self.error_px * max(frames, 1.0))
        gate = gate * (1 + _GROWTH * self.unseen)
        if (new := self.seen + self.unseen < _MEMORY).any():
            gate = np.where(new, np.maximum(gate, self._first_gate(diameter_px)), gate)
        return Prediction(position, np.minimum(gate, _WIDEST * diameter_px), self.velocity(position, frames))

    def velocity(self, position_px: np.ndarray, frames: float) -> np.ndarray:
        """Return (m, 2) px a frame, of markers that are at (m, 2) after so many frames."""
        step = (position_px - self.past[0]) / frames
        before = (self.past[0] - self.past[1]) / (self.times[0] - self.times[1])
        return step + np.where((self.seen >= 2)[:, None], (step - before) / 2, 0.0)

    def update(self, predicted_px: np.ndarray, measured_px: np.ndarray, seen: np.ndarray, frames: float = 1.0) -> None:
        """Update with a frame: where each marker was predicted and, if seen (m,), measured, (m, 2) each."""
        position = np.where(seen[:, None], measured_px, predicted_px)
        error = np.linalg.norm(measured_px - predicted_px, axis=1)
        trusted = seen & (self.seen >= _MEMORY)
        self.error_px = np.where(trusted, np.maximum(error, _FORGET * self.error_px), self.error_px)
        self._learn_beat(position, frames, seen & (self.seen >= _MEMORY))
        self.past = np.concatenate([position[None], self.past[:-1]])
        self.times = np.concatenate([[0.0], self.times[:-1] - frames])
        self.unseen = np.where(seen, 0, self.unseen + 1)
        self.seen = np.where(seen, np.minimum(self.seen + 1, _MEMORY), 0)

    @property
    def _beat_rad(self) -> float:
        twice_cos, slow_fast = self.beat[0] / max(self.beat[1], 1e-9), 2 * np.cos(_BEAT)
        return float(np.arccos(np.clip(twice_cos, *slow_fast[::-1]) / 2)) if self.beat[1] > 0 else _BEAT[0]

    def _learn_beat(self, position_px: np.ndarray, frames: float, which: np.ndarray) -> None:
        """Learn the beat from markers (m, 2) that were seen now and in the last three frames, in about equal steps."""
        steps = -np.diff(self.times, prepend=frames)  # (3,)
        if which.any() and np.ptp(steps) < 0.1:
            now, last, before = -np.diff(np.concatenate([position_px[None], self.past])[:, which], axis=0)  # (3, k, 2)
            self.beat = _KEEP_BEAT * self.beat + [np.sum(last * (now + before)), np.sum(last * last)]

    def _first_gate(self, diameter_px: np.ndarray) -> np.ndarray:
        """Return (m,) gates of markers of unknown acceleration: nearer to them than to others they may be anywhere."""
        apart = np.linalg.norm(self.past[0][:, None] - self.past[0][None], axis=2)
        nearest = np.sort(apart, axis=1)[:, 1] if len(apart) > 1 else 0.0
        least, share = _FIRST
        return np.maximum(least * diameter_px, share * nearest)

    def _with_neighbours(self, position: np.ndarray, lost: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return (m, 2) positions, the lost ones carried along by the two nearest markers that are seen."""
        result = position.copy()
        there = np.flatnonzero(~lost)
        for marker in np.flatnonzero(lost):
            own = velocity[marker] * _FADE
            if len(there) < 2:
                result[marker] = self.past[0, marker] + own
                continue
            near = there[np.argsort(np.linalg.norm(self.past[0, there] - self.past[0, marker], axis=1))[:2]]
            result[marker] = _carried(self.past[0, marker], self.past[0, near], position[near])
        return result


def _carried(point: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return (2,) a point moved as rigidly as two others (2, 2) moved."""
    old, new = before[1] - before[0], after[1] - after[0]
    turn = np.arctan2(new[1], new[0]) - np.arctan2(old[1], old[0])
    cos, sin = np.cos(turn), np.sin(turn)
    relative = point - before[0]
    return after[0] + np.array([cos * relative[0] - sin * relative[1], sin * relative[0] + cos * relative[1]])


@dataclass(eq=False)
class Spacing:
    """The markers as a tree, each joined to its nearest, and each with two nearby markers as its guides."""

    pairs: np.ndarray  # (e, 2) which are joined
    lengths: np.ndarray  # (2, e) the least and the most that they were apart, px
    guides: np.ndarray  # (m, 2) two markers near each; (0, 2) where none is joined to another
    ratios: np.ndarray  # (m,) complex place of each marker between its guides: 0 on the first, 1 on the second
    doubted: np.ndarray  # (m,) bool, in the last frame unlike itself: no distance may change on its account

    @classmethod
    def begin(cls, position_px: np.ndarray, one_body: bool = True) -> "Spacing":
        """Measure the spacing of markers (m, 2) in the frame of the boxes; without `one_body` none are neighbours."""
        distance = np.linalg.norm(position_px[:, None] - position_px[None], axis=2)
        tree = minimum_spanning_tree(distance).tocoo()
        joined = slice(None if one_body and len(position_px) > 2 else 0)
        pairs, lengths = np.column_stack([tree.row, tree.col])[joined], np.tile(tree.data[joined], (2, 1))
        guides = np.argsort(distance, axis=1, kind="stable")[:, 1:3][: len(position_px) if len(pairs) else 0]
        return cls(pairs, lengths, guides, _between(position_px, guides), np.zeros(len(position_px), bool))

    def misplaced(
        self,
        position_px: np.ndarray,
        predicted_px: np.ndarray,
        moved_px: np.ndarray,
        seen: np.ndarray,
        strength: np.ndarray,
        diameter_px: np.ndarray,
    ) -> np.ndarray:
        """Return (m,) bool, the markers, of those seen at (m, 2), that broke away from a neighbour.

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
        """Scale all distances with most of those (e,) that are seen: the robot comes nearer, or dives."""
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
        """Return (e,) bool, the pairs too close or too far apart; learn from those of which both are seen (e,)."""
        larger, (least, most) = diameter_px[self.pairs].max(axis=1), self.lengths
        swim = self._swimming(np.linalg.norm(moved_px, axis=1), larger, both, seen)
        swim &= ~self.doubted[self.pairs].any(axis=1)
        length, foreseen = _lengths(position_px, self.pairs), _lengths(predicted_px, self.pairs)
        low, high = np.where(swim, [np.minimum(least, foreseen), np.maximum(most, foreseen)], self.lengths)
        off: np.ndarray = length < low - np.maximum(_LEAST * larger, _RELATIVE * low)
        off |= length > high + np.maximum(_LEAST * larger, _RELATIVE * high)
        within = [np.minimum(least, length), np.maximum(most, length)]
        self.lengths = np.where(both & swim & ~off, within, self.lengths)
        return off

    def _swimming(self, moved_px: np.ndarray, larger_px: np.ndarray, both: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Return (e,) bool, the pairs whose distance may change.

        Both move; one does and the other rests with a third; or one alone moves of all that are seen (m,).
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
        """Return (m, 2) where two guides put each marker, moved and turned with them since it was last seen well."""
        if not len(self.guides):
            return position_px.copy()
        plane = position_px @ np.array([1, 1j])
        a, b = plane[self.guides.T]
        place = a + self.ratios * (b - a)
        return np.stack([place.real, place.imag], axis=1)

    def learn(self, position_px: np.ndarray, sure: np.ndarray, doubted: np.ndarray) -> None:
        """Learn from a frame: (m, 2) positions, and (m,) bool which were seen well, and which look like another."""
        self.doubted = doubted
        if len(self.guides):
            known = sure & sure[self.guides].all(axis=1)
            mixed = _KEEP * self.ratios + (1 - _KEEP) * _between(position_px, self.guides)
            self.ratios = np.where(known, mixed, self.ratios)


def _lengths(position_px: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return (e,) distances of pairs (e, 2) of markers at (m, 2)."""
    return np.linalg.norm(position_px[pairs[:, 0]] - position_px[pairs[:, 1]], axis=1)


def _between(position_px: np.ndarray, guides: np.ndarray) -> np.ndarray:
    """Return (m,) complex place of each marker between its two guides (m, 2)."""
    plane = position_px[: len(guides)] @ np.array([1, 1j])
    a, b = plane[guides.T] if len(guides) else (plane, plane)
    return (plane - a) / np.where(a == b, 1, b - a)


class Assembly(NamedTuple):
    """An assignment of all markers of a frame.

    Attributes:
        cost: the sum that was made least, without unit.
        chosen: (m,) the number of each marker's spot, -1 for none.
    """

    cost: float
    chosen: np.ndarray


def assemble_markers(
    spots: Spots, predicted: Prediction, spread_px: np.ndarray, spacing: Spacing, whole: bool
) -> Assembly:
    """Assign spots to all markers at the least cost over motion and distances.

    Args:
        spots: all candidates; one farther from a marker than `predicted.gate_px` is not its own.
        predicted: where the m markers are expected.
        spread_px: (m,) how far from there they usually are.
        spacing: which of them are joined.
        whole: the body may have been moved as a whole.
    """
    shifts = _shifts(spots, predicted, spacing) if whole else [np.zeros(2)]
    usual_px = float(np.median(spacing.lengths.mean(axis=0)))
    links = _links(spots, predicted, spacing)
    found = []
    for shift in shifts:
        cost, chosen = share_out(_alone(spots, predicted, spread_px, shift), links, spacing.pairs)
        found.append(Assembly(cost + _SHIFT * float(shift @ shift) / usual_px**2, chosen))
    return min(found, key=lambda each: each.cost)


def price(spots: Spots) -> np.ndarray:
    """Return the price of each spot wherever it is: (c,) for its faintness, or (m, c) with its hue for each marker."""
    faintness = FAINTER * np.clip(1 - spots.strength, 0, 1)
    return faintness if spots.mismatch is None else faintness + OTHER_HUE * spots.mismatch


def _alone(spots: Spots, predicted: Prediction, spread_px: np.ndarray, shift_px: np.ndarray) -> np.ndarray:
    """Cost (m, c + 1) of each marker on each spot; the last column is that of no spot."""
    away = predicted.position_px[:, None] - spots.position_px[None]
    reached = np.linalg.norm(away, axis=2) <= predicted.gate_px[:, None]
    off = np.linalg.norm(away + shift_px, axis=2) / spread_px[:, None]
    cost = off**2 + price(spots)
    return np.hstack([np.where(reached, cost, _NEVER), np.full((len(off), 1), MISSED)])


def _links(spots: Spots, predicted: Prediction, spacing: Spacing) -> np.ndarray:
    """Cost (e, c + 1, c + 1) of each link between two spots: by its length, and by its turn since the last frame.

    A marker without a spot is taken to be where it is expected, and its links count less.
    """
    plane, expected = spots.position_px @ np.array([1, 1j]), predicted.position_px @ np.array([1, 1j])
    one, other = (np.column_stack([np.tile(plane, (len(end), 1)), expected[end]]) for end in spacing.pairs.T)
    between = other[:, None, :] - one[:, :, None]  # (e, c + 1, c + 1) from the first to the second
    foreseen = between[:, -1:, -1:]
    low, high = spacing.lengths[..., None, None]
    length = np.abs(between)
    beyond = np.maximum(np.maximum(low - length, length - high), 0)
    turned = np.angle(between * foreseen.conj())
    cost = np.minimum((beyond / (_STIFF * high + _STIFF_PX)) ** 2 + (turned / _TURN_RAD) ** 2, _LINK)
    cost[:, -1, :-1] *= _UNSEEN
    cost[:, :-1, -1] *= _UNSEEN
    cost[:, -1, -1] = 0
    return cost


def _shifts(spots: Spots, predicted: Prediction, spacing: Spacing) -> list[np.ndarray]:
    """List shifts (2,) of the body, px: none, and those that bring a marker at an end of the tree onto a spot.

    Of these the ones that put the most markers near a spot like themselves are kept, short ones first.
    """
    joints = np.bincount(spacing.pairs.ravel(), minlength=len(predicted.gate_px))
    away = spots.position_px[None] - predicted.position_px[joints == 1][:, None]
    near = np.linalg.norm(away, axis=2) <= predicted.gate_px[joints == 1][:, None]
    shifts = away[near]
    usual_px = float(np.median(spacing.lengths.mean(axis=0)))
    place = (predicted.position_px + shifts[:, None])[:, :, None]  # (k, m, 1, 2)
    beside = np.linalg.norm(place - spots.position_px, axis=3) < _STIFF * usual_px + _STIFF_PX
    alike = np.where(beside, np.clip(spots.strength, 0, 1), 0.0).max(axis=2, initial=0.0).sum(axis=1)
    best = np.argsort(_SHIFT * (shifts**2).sum(axis=1) / usual_px**2 - alike, kind="stable")[:_SHIFTS]
    return [np.zeros(2), *shifts[best]]


def share_out(alone: np.ndarray, links: np.ndarray, pairs: np.ndarray) -> tuple[float, np.ndarray]:
    """Find the least cost with each spot used once, and (m,) the spots, -1 for none.

    Args:
        alone: (m, c + 1) the cost of each spot for each marker, and of none.
        links: (e, c + 1, c + 1) the cost of two spots for each pair.
        pairs: (e, 2) the tree of markers.
    """
    number = count()  # breaks ties: the solution found first wins
    queue: list[tuple[float, int, np.ndarray, np.ndarray]] = []

    def solve(allowed: np.ndarray) -> None:
        cost, chosen = _least(allowed, links, pairs)
        heappush(queue, (cost, next(number), chosen, allowed))

    none = alone.shape[1] - 1
    solve(alone)
    for _ in range(_SOLVED):
        cost, _, chosen, allowed = heappop(queue)
        twice = np.flatnonzero(np.bincount(chosen[chosen < none], minlength=1) > 1)
        if not len(twice):
            return cost, np.where(chosen < none, chosen, -1)
        for marker in np.flatnonzero(chosen == twice[0]).tolist():
            without = allowed.copy()
            without[marker, twice[0]] = _NEVER
            solve(without)
    return _NEVER, np.full(len(alone), -1)


def _least(alone: np.ndarray, links: np.ndarray, pairs: np.ndarray) -> tuple[float, np.ndarray]:
    """Find the least cost where spots may be shared, and (m,) the spots; none is numbered behind the last."""
    steps = _walk(tuple(map(tuple, pairs.tolist())))
    total, back = alone.copy(), np.zeros(alone.shape, int)
    for marker, above, edge, onwards in reversed(steps):
        link = links[edge] if onwards else links[edge].T  # (of the one above, own)
        both = link + total[marker][None]
        back[marker] = both.argmin(axis=1)
        total[above] += both.min(axis=1)
    top = steps[0][1]
    chosen = np.empty(len(alone), int)
    chosen[top] = total[top].argmin()
    for marker, above, _, _ in steps:
        chosen[marker] = back[marker, chosen[above]]
    return float(total[top].min()), chosen


@lru_cache
def _walk(pairs: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int, int, bool], ...]:
    """Walk the tree from its first marker: each marker, the one above it, their pair, and whether that is first."""
    steps: list[tuple[int, int, int, bool]] = []
    reached, left = {pairs[0][0]}, dict(enumerate(pairs))
    while left:
        edge = next(k for k, pair in left.items() if reached & set(pair))
        one, other = left.pop(edge)
        steps.append((other, one, edge, True) if one in reached else (one, other, edge, False))
        reached |= {one, other}
    return tuple(steps)
