"""What of a tracked trial may count: not markers lost, drifting, of the wrong size, exchanged or misplaced."""

from itertools import pairwise

import numpy as np
import pandas as pd
import xarray as xr
from scipy.ndimage import maximum_filter1d, median_filter

from session import Flag
from session.tracks import markers_of, pixels_of
from swimmer import RobotSpec
from tracking.quality import check_tracks
from tracking.records.tracked import but_repeats, counting, repeated_frames, seen_in
from tracking.stretches import stretches

SIZE_OFF = 0.3
"""Relative departure of the apparent diameter from its median."""
SIZE_FRAMES = 5
"""Over which the median of that departure is taken, so that one blurred frame is not flagged."""
LEAST_CONFIDENCE = 0.35
"""A marker below it …"""
DRIFT_FRAMES = 10
"""… for so many frames on end may have drifted onto something else."""
EXCHANGE = 0.5
"""Two neighbours are taken for exchanged when exchanging them shortens the line through the markers by this share of
their own distance."""
EXCHANGE_FRAMES = 2
"""The shortest exchange that is flagged."""
FAST, FAST_FRAMES = 0.5, 3
"""A marker that moves between two frames by this share of the distance to its nearest neighbour, once in so many
frames, is named by the body's distances alone: no motion can be carried on."""
APART, LEAST_FRAMES = 0.5, 3
"""In tracks from elsewhere two markers count as exchanged while further apart than this share of what is usual, for so
many frames: what is nearer is merged."""


def trusted(tracked: xr.Dataset, layout: RobotSpec) -> xr.Dataset:
    """Judges a tracked trial by all there is: states, look, order along the body, shape and motion.

    It comes after edits and filled gaps; of the layout only the markers are used. It gets the flags of the tracker, of
    `judge` and of `check_tracks`, each once, and its weights: 0 where a sample does not count, or is not believed.
    """
    own = [flag for flag in (*tracked.flags, *judge(tracked, layout)) if flag.kind != "gap"]
    first = int(np.argmax(seen_in(tracked).any(axis=1)))
    quality = check_tracks(counting(tracked.assign_attrs(flags=tuple(own))).isel(time=slice(first, None)), layout)
    weight = np.zeros(tracked.state.shape)
    weight[first:] = quality.weight
    flags = (*own, *but_repeats(tracked, (flag.later(first) for flag in quality.flags)))
    found = tracked.assign(weight=(("time", "keypoint"), weight))
    return found.assign_attrs(flags=tuple(dict.fromkeys(flags)))


def judge(tracked: xr.Dataset, layout: RobotSpec) -> tuple[Flag, ...]:
    """The flags of a tracked trial, by first frame: ``lost_marker``, ``drift``, ``size``, ``swap`` and ``few_frames``.

    Merged, frozen and jumping markers are found on any tracks, tracked here or elsewhere: `tracking.check_tracks`.
    """
    seen = seen_in(tracked)
    low_confidence = seen & (tracked.confidence.values < LEAST_CONFIDENCE)
    suspicions = {
        "lost_marker": (~seen & ~repeated_frames(tracked)[:, None], 1, "is not seen"),
        "drift": (low_confidence, DRIFT_FRAMES, "has lost its appearance; the tracker may have drifted"),
        "size": (_wrong_size(tracked), 1, "appears in another size"),
    }
    flags = [
        Flag(kind, (marker,), span, f"{marker} {message}")
        for kind, (where, least, message) in suspicions.items()
        for k, marker in enumerate(markers_of(tracked))
        for span in stretches(where[:, k], least)
    ]
    flags += exchange_flags(tracked, layout)
    flags += _few_frames(tracked)
    return tuple(sorted(flags, key=lambda flag: flag.frames or (-1, -1)))


def _wrong_size(tracked: xr.Dataset) -> np.ndarray:
    size = pd.DataFrame(tracked["size"].values)
    off = (size / size.median() - 1).abs().fillna(0.0)
    return median_filter(off, size=(SIZE_FRAMES, 1)) > SIZE_OFF


def _few_frames(tracked: xr.Dataset) -> list[Flag]:
    """A flag for each stretch in which markers move too far between frames for their motion to be carried on."""
    position = np.where(seen_in(tracked)[..., None], pixels_of(tracked), np.nan)
    apart = np.linalg.norm(position[:, :, None] - position[:, None], axis=3)  # (n, m, m)
    apart[:, np.arange(apart.shape[1]), np.arange(apart.shape[1])] = np.inf
    nearest = np.nan_to_num(apart, nan=np.inf).min(axis=2)[1:]
    share = np.nan_to_num(np.linalg.norm(np.diff(position, axis=0), axis=2) / nearest)  # (n - 1, m)
    fast = maximum_filter1d(np.concatenate([[0.0], share.max(axis=1)]), FAST_FRAMES) > FAST
    flags = []
    for first, last in stretches(fast, 2 * FAST_FRAMES):
        inside = share[max(first - 1, 0) : last]
        names = tuple(np.array(markers_of(tracked), dtype=object)[(inside > FAST).any(axis=0)].tolist())
        message = (
            f"moves by up to {inside.max():.0%} of the distance to its nearest neighbour from one frame to the next: "
            "too few frames a beat to carry motion on; its name rests on the distances along the body. Film with more "
            "frames a second"
        )
        flags.append(Flag("few_frames", names, (first, last), message))
    return flags


def exchange_flags(tracked: xr.Dataset, layout: RobotSpec) -> list[Flag]:
    """Pairs of neighbours on the mid line that are the wrong way round, and of left and right markers.

    The markers of the mid line are in one order along the body, however it bends: exchanging two of them back makes
    the line through all of them shorter. A left marker is to the left of the line through the first two of them.
    """
    names = markers_of(tracked)
    place = layout.marker_positions_m(names)  # (m, 3)
    middle = [k for k in np.argsort(place[:, 0], kind="stable") if abs(place[k, 1]) < 1e-6]
    pairs = [(pair, _shorter_exchanged(pixels_of(tracked), middle, *pair)) for pair in pairwise(middle)]
    if len(middle) > 1:
        pairs += [(pair, _mirrored(pixels_of(tracked), middle, *pair)) for pair in _sides(place)]
    return [
        Flag("swap", (names[a], names[b]), span, f"{names[a]} and {names[b]} seem to be exchanged")
        for (a, b), wrong in pairs
        for span in stretches(wrong, EXCHANGE_FRAMES)
    ]


def exchanged_apart(tracked: xr.Dataset, layout: RobotSpec) -> tuple[Flag, ...]:
    """The exchanges in tracks from elsewhere: of two markers that are as far apart as usual, not on one spot."""
    names, position = markers_of(tracked), pixels_of(tracked)
    found = []
    for flag in exchange_flags(tracked, layout):
        one, other = (names.index(marker) for marker in flag.markers)
        apart, (first, last) = np.linalg.norm(position[:, one] - position[:, other], axis=1), flag.frames or (0, -1)
        if last - first + 1 >= LEAST_FRAMES and np.nanmedian(apart[first : last + 1]) > APART * np.nanmedian(apart):
            found.append(flag)
    return tuple(found)


def _shorter_exchanged(position: np.ndarray, order: list[int], a: int, b: int) -> np.ndarray:
    """(n,) whether exchanging a and b shortens the line through the markers around them by `EXCHANGE` of |a b|."""
    at = order.index(a)
    around = order[max(at - 1, 0) : at + 3]
    exchanged = [b if k == a else a if k == b else k for k in around]

    def length(line: list[int]) -> np.ndarray:
        return np.linalg.norm(np.diff(position[:, line], axis=1), axis=2).sum(axis=1)

    apart = np.linalg.norm(position[:, a] - position[:, b], axis=1)
    with np.errstate(invalid="ignore"):
        return length(around) - length(exchanged) > EXCHANGE * apart


def _sides(place: np.ndarray) -> list[tuple[int, int]]:
    """Pairs of markers that mirror each other."""
    return [
        (a, b)
        for a in range(len(place))
        for b in range(len(place))
        if place[a, 1] < -1e-6 and np.allclose(place[a] * [1, -1, 1], place[b])
    ]


def _mirrored(position: np.ndarray, order: list[int], left: int, right: int) -> np.ndarray:
    """(n,) whether a left marker is to the right, seen along the first two of the mid line; image y runs down."""
    axis = position[:, order[1]] - position[:, order[0]]
    across = position[:, right] - position[:, left]
    return axis[:, 0] * across[:, 1] - axis[:, 1] * across[:, 0] > 0
