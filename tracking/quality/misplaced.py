"""Which samples of a trial are misplaced: what following the markers in both directions of time agrees on."""

from itertools import pairwise

import numpy as np

from tracking.quality.body_model import BodyModel, rows_alike
from tracking.quality.following import Gate, MotionTrack, follow
from tracking.stretches import stretches

CLEARLY = 1.5
"""One of two is clearly misplaced if it is this many times as far from its place, in its own spread."""

LEAST_SEEN = 0.2
"""A jump and its way back belong together if the marker is seen apart in this share of the frames between."""
LASTING = 3
"""Frames that a marker is apart at least after a jump, before the model gives in. Where a fast tail turns round it is
apart for a frame, followed in either direction, before and after the turn: that is no jump, nor a way back."""


def misplaced(
    model: BodyModel,
    time_s: np.ndarray,
    position_px: np.ndarray,
    present: np.ndarray,
    start: np.ndarray,
    gate: Gate,
) -> np.ndarray:
    """(n, m) the samples that fit in neither direction of time, and stretches that both enclose; as for `follow`."""
    ahead = follow(model, time_s, position_px, present, start, gate)
    back = follow(model, -time_s[::-1], position_px[::-1], present[::-1], start[::-1], gate)
    back = MotionTrack(back.active[::-1], back.place_px[::-1])
    wrong = present & ~ahead.active & ~back.active
    for k in range(position_px.shape[1]):
        for first, last in _enclosed(k, position_px, present, ahead, back):
            wrong[first : last + 1, k] |= present[first : last + 1, k]
    return wrong


def clashing(model: BodyModel, position_px: np.ndarray, active: np.ndarray, least_px: np.ndarray) -> np.ndarray:
    """(n, m) of two active markers on one spot the one that is further from its place; both if that is not clear.

    Markers never come closer than (m, m) `least_px`.
    """
    clash = np.zeros_like(active)
    for pair in zip(*np.triu_indices(active.shape[1], 1), strict=True):
        between = np.linalg.norm(position_px[:, pair[0]] - position_px[:, pair[1]], axis=1)  # (n,)
        near = np.flatnonzero(active[:, pair].all(axis=1) & (between < least_px[pair]))
        rest = active[near] & ~np.isin(np.arange(active.shape[1]), pair)
        for mask, rows in rows_alike(rest):
            put_px = model.put_by_others(position_px[near[rows]], rest[rows])  # (f, m, 2)
            off_px = np.linalg.norm(position_px[near[rows]] - put_px, axis=2)[:, pair]  # (f, 2)
            off = off_px / model.shape_and_pose.spread_given(mask)[list(pair)]
            clash[near[rows][:, None], pair] |= CLEARLY * off > off[:, ::-1]
    return clash


def widened(wrong: np.ndarray, off: np.ndarray, join: int) -> np.ndarray:
    """(n, m) `wrong`, extended along the frames that are `off` and across gaps of up to `join` frames."""
    wide = wrong.copy()
    for k in range(wrong.shape[1]):
        for first, last in stretches(off[:, k] | wrong[:, k]):
            wide[first : last + 1, k] |= wrong[first : last + 1, k].any()
        for (_, before), (after, _) in pairwise(stretches(wide[:, k])):
            wide[before:after, k] |= after - before <= join + 1
    return wide


def _enclosed(
    k: int, position_px: np.ndarray, present: np.ndarray, ahead: MotionTrack, back: MotionTrack
) -> list[tuple[int, int]]:
    """Stretches of marker k that it enters by one jump and leaves by the opposite one.

    Followed forwards it is apart from the first frame on until the model gives in, backwards from the last.
    A step without a way back can be wrong on either side; boxes lag and then snap back to their marker, so it
    is the side before unless that is much the longer.
    """
    found = []
    apart_ahead, apart_back = present[:, k] & ~ahead.active[:, k], present[:, k] & ~back.active[:, k]
    for first, end in stretches(apart_ahead):
        entered = position_px[first, k] - ahead.place_px[first, k]
        tolerance_px = max(4.0, 0.5 * float(np.linalg.norm(entered)))
        for start, last in stretches(apart_back):
            turned = min(end - first, last - start) + 1 < LASTING <= last - first + 1
            alone = not apart_ahead[start : last + 1].any() and not apart_back[first : end + 1].any()
            if first - 2 <= last < first and alone and max(end - first, last - start) + 1 >= LASTING:
                found.append((start, last) if last - start <= 3 * (end - first + 1) else (first, end))
            exited = position_px[last, k] - back.place_px[last, k]
            seen = (apart_ahead | apart_back)[first : last + 1].mean() if last >= first else 0.0
            if not turned and seen >= LEAST_SEEN and np.linalg.norm(entered - exited) <= tolerance_px:
                found.append((first, last))
                break
            if abs(last - end) <= 1:  # it was back before
                break
    return found


def reaching(mask: np.ndarray, off_px: np.ndarray, least_px: float) -> np.ndarray:
    """(n, m) the stretches of `mask` in which a marker gets this far from where the others put it."""
    reach = np.zeros_like(mask)
    for k in range(mask.shape[1]):
        for first, last in stretches(mask[:, k]):
            reach[first : last + 1, k] = off_px[first : last + 1, k].max() >= least_px
    return reach
