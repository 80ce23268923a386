"""What is doubtful about a tracked trial: markers lost, drifting, of the wrong size, or exchanged."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter

from session import Flag
from swimmer import RobotSpec
from tracking.records import TrackedTrial
from tracking.suspects import stretches


@dataclass(frozen=True)
class JudgementLimits:
    """When a sample is doubtful.

    Attributes:
        size: relative departure of the apparent diameter from its median.
        size_frames: over which the median of that departure is taken, so that one blurred frame is not flagged.
        confidence: a marker below it …
        drift_frames: … for so many frames on end may have drifted onto something else.
        exchange: two neighbours are taken for exchanged when exchanging them shortens the line through the markers
            by this share of their own distance.
        exchange_frames: the shortest exchange that is flagged.
    """

    size: float = 0.3
    size_frames: int = 5
    confidence: float = 0.35
    drift_frames: int = 10
    exchange: float = 0.5
    exchange_frames: int = 2


def judge(tracked: TrackedTrial, layout: RobotSpec, limits: JudgementLimits | None = None) -> tuple[Flag, ...]:
    """The doubts about a tracked trial, by first frame: ``lost_marker``, ``drift``, ``size`` and ``swap``.

    Merged, frozen and jumping markers are found on any tracks, tracked here or elsewhere: `tracking.check_tracks`.

    Args:
        tracked: n frames of m markers, before or after gaps were filled.
        layout: the robot, of which only the markers are used.
        limits: when a sample is doubtful.
    """
    limits = limits or JudgementLimits()
    doubts = {
        "lost_marker": (~tracked.seen, "is not seen"),
        "drift": (_drifting(tracked, limits), "looks unlike itself; it may have drifted onto something else"),
        "size": (_wrong_size(tracked, limits), "appears in another size"),
    }
    flags = [
        Flag(kind, (marker,), span, f"{marker} {message}")
        for kind, (where, message) in doubts.items()
        for k, marker in enumerate(tracked.tracks.markers)
        for span in stretches(where[:, k])
    ]
    flags += _exchanges(tracked, layout, limits)
    return tuple(sorted(flags, key=lambda flag: flag.frames or (-1, -1)))


def _drifting(tracked: TrackedTrial, limits: JudgementLimits) -> np.ndarray:
    doubtful = tracked.seen & (tracked.tracks.confidence < limits.confidence)
    result = np.zeros_like(doubtful)
    for k in range(doubtful.shape[1]):
        for first, last in stretches(doubtful[:, k]):
            result[first : last + 1, k] = last - first + 1 >= limits.drift_frames
    return result


def _wrong_size(tracked: TrackedTrial, limits: JudgementLimits) -> np.ndarray:
    size = tracked.size_px
    known = np.isfinite(size)
    typical = np.array(
        [np.median(column[there]) if there.any() else 1.0 for column, there in zip(size.T, known.T, strict=True)]
    )
    off = np.where(known, np.abs(size / typical - 1), 0.0)
    return median_filter(off, size=(limits.size_frames, 1)) > limits.size


def _exchanges(tracked: TrackedTrial, layout: RobotSpec, limits: JudgementLimits) -> list[Flag]:
    """Pairs of neighbours on the mid line that lie the wrong way round, and of left and right markers.

    The markers of the mid line stand in one order along the body, however it bends: exchanging two of them back makes
    the line through all of them shorter. A left marker lies to the left of the line through the first two of them.
    """
    names = tracked.tracks.markers
    place = layout.marker_positions_m(names)  # (m, 3)
    middle = [k for k in np.argsort(place[:, 0], kind="stable") if abs(place[k, 1]) < 1e-6]
    flags: list[Flag] = []
    for left, right in pairwise(middle):
        wrong = _shorter_exchanged(tracked.tracks.position_px, middle, left, right, limits.exchange)
        flags += _flagged(names, (left, right), wrong, limits)
    for left, right in _sides(place) if len(middle) > 1 else ():
        wrong = _mirrored(tracked.tracks.position_px, middle, left, right)
        flags += _flagged(names, (left, right), wrong, limits)
    return flags


def _flagged(names: tuple[str, ...], pair: tuple[int, int], wrong: np.ndarray, limits: JudgementLimits) -> list[Flag]:
    a, b = (names[k] for k in pair)
    message = f"{a} and {b} seem to be exchanged"
    return [
        Flag("swap", (a, b), span, message)
        for span in stretches(wrong)
        if span[1] - span[0] + 1 >= limits.exchange_frames
    ]


def _shorter_exchanged(position: np.ndarray, order: list[int], a: int, b: int, share: float) -> np.ndarray:
    """(n,) whether exchanging a and b shortens the line through the markers around them by that share of |a b|."""
    at = order.index(a)
    around = order[max(at - 1, 0) : at + 3]
    exchanged = [b if k == a else a if k == b else k for k in around]

    def length(line: list[int]) -> np.ndarray:
        return np.linalg.norm(np.diff(position[:, line], axis=1), axis=2).sum(axis=1)

    apart = np.linalg.norm(position[:, a] - position[:, b], axis=1)
    with np.errstate(invalid="ignore"):
        return length(around) - length(exchanged) > share * apart


def _sides(place: np.ndarray) -> list[tuple[int, int]]:
    """Pairs of markers that mirror each other."""
    return [
        (a, b)
        for a in range(len(place))
        for b in range(len(place))
        if place[a, 1] < -1e-6 and np.allclose(place[a] * [1, -1, 1], place[b])
    ]


def _mirrored(position: np.ndarray, order: list[int], left: int, right: int) -> np.ndarray:
    """(n,) whether a left marker lies to the right, seen along the first two of the mid line; image y runs down."""
    axis = position[:, order[1]] - position[:, order[0]]
    across = position[:, right] - position[:, left]
    return axis[:, 0] * across[:, 1] - axis[:, 1] * across[:, 0] > 0
