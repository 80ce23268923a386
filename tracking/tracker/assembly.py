"""Assign the spots of a frame to all markers at once, where the nearest spot need not be the right one.

Markers are joined to a tree, each to its nearest. A choice of spots costs the departure of each marker from its
expected place, the departure of each link of the tree from its length and direction so far, and a price for each marker
without a spot. The least cost over a tree is found exactly by dynamic programming from its leaves (Felzenszwalb and
Huttenlocher, Pictorial structures for object recognition, IJCV 61, 2005, section 3). Where two markers would share a
spot, each of them is tried without it. A shift of the whole body costs little: the sum is also tried with all markers
shifted by what a marker at an end of the tree may have moved.
"""

from functools import lru_cache
from heapq import heappop, heappush
from itertools import count
from typing import NamedTuple

import numpy as np

from tracking.tracker.prediction import Prediction
from tracking.tracker.spacing import Spacing
from tracking.tracker.spots import Spots

MISSED = 2.0
"""The price of leaving a marker without a spot."""
FAINTER = 1.0
"""The price of a spot of no strength."""
_STIFF, _STIFF_PX = 0.06, 1.5  # standard deviation of a link's length: a share of it, and px of the start boxes
_TURN_RAD = 0.6  # standard deviation of a link's direction about the one predicted
_LINK = 2.5  # the most that one link can cost: bodies bend more than they did so far
_UNSEEN = 0.4  # weight of a link to a marker without a spot
_SHIFT = 0.3  # the price of a shift of the body by the usual distance of its markers
_SHIFTS = 12  # tried at most, the shortest first
_SOLVED = 40  # solutions tried at most until no spot is used twice
_NEVER = 1e6


class Assembly(NamedTuple):
    """An assignment of all markers of a frame.

    Attributes:
        cost: the sum that was made least, without unit.
        chosen: (m,) the number of each marker's spot, -1 for none.
    """

    cost: float
    chosen: np.ndarray


def assemble(spots: Spots, predicted: Prediction, spread_px: np.ndarray, spacing: Spacing, whole: bool) -> Assembly:
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
        cost, chosen = _shared_out(_alone(spots, predicted, spread_px, shift), links, spacing.pairs)
        found.append(Assembly(cost + _SHIFT * float(shift @ shift) / usual_px**2, chosen))
    return min(found, key=lambda each: each.cost)


def _alone(spots: Spots, predicted: Prediction, spread_px: np.ndarray, shift_px: np.ndarray) -> np.ndarray:
    """Cost (m, c + 1) of each marker on each spot; the last column is that of no spot."""
    away = predicted.position_px[:, None] - spots.position_px[None]
    reached = np.linalg.norm(away, axis=2) <= predicted.gate_px[:, None]
    off = np.linalg.norm(away + shift_px, axis=2) / spread_px[:, None]
    cost = off**2 + FAINTER * np.clip(1 - spots.strength, 0, 1)
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
    """List shifts (2,) of the body, px: none, and those that bring a marker at an end of the tree onto a spot."""
    joints = np.bincount(spacing.pairs.ravel(), minlength=len(predicted.gate_px))
    away = spots.position_px[None] - predicted.position_px[joints == 1][:, None]
    near = np.linalg.norm(away, axis=2) <= predicted.gate_px[joints == 1][:, None]
    shifts = away[near]
    nearest = np.argsort(np.linalg.norm(shifts, axis=1), kind="stable")[:_SHIFTS]
    return [np.zeros(2), *shifts[nearest]]


def _shared_out(alone: np.ndarray, links: np.ndarray, pairs: np.ndarray) -> tuple[float, np.ndarray]:
    """Find the least cost with each spot used once, and (m,) the spots, -1 for none."""
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
