"""Markers that follow another dot, or lie off their place.

`follow` holds each sample against the body's shape and against its own motion, from frame to frame: the prediction and
the gate of a Kalman filter in their plainest form. A marker is expected where its last two places carry on to and where
the other markers put it, combined by their precisions; of the samples of a frame the worst is left out until the rest
agree. The place of one that is left out is carried on from the others, so that a fault that lasts stays apart. Motion
decides what shape alone cannot: which of three markers on a rigid line has moved. `misplaced` lists the samples that
following in both directions of time agrees on.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tracking.body_model import BodyModel, JointGaussian, rows_alike
from tracking.harmed_frames import stretches

# `follow`: each sample against shape and motion.
FADE = 0.97
"""Keep this share, frame by frame, of a left-out marker's last known distance from where the others put it."""
RAYLEIGH_MEDIAN = np.sqrt(2 * np.log(2))
"""Median length of a vector whose two coordinates are normal with standard deviation 1."""
RAYLEIGH_90 = np.sqrt(2 * np.log(10))
"""Length that nine of ten such vectors do not exceed."""
TURNS = 2.0
"""A tail that turns round sharply is that much further from its steady motion, at most, than in half of the frames."""
AT_MOST_AHEAD = 2.5
"""Motion carries on over a time step no longer than this many times the one before."""
LEAST_SPREAD_PX = 1.0
"""Least that a marker is usually off its steady motion, in each coordinate."""
BOX_SD_PX = 1.0
"""Spread of a box about its marker in each coordinate (boxes are whole pixels, their centres half ones)."""

# `misplaced`: what both directions of time agree on.
CLEARLY = 1.5
"""One of two is clearly misplaced if it is this many times as far from its place, in its own spread."""

LEAST_SEEN = 0.2
"""A jump and its way back belong together if the marker is seen apart in this share of the frames between."""
LASTING = 3
"""Frames that a marker is apart at least after a jump, before the model gives in. Where a fast tail turns round it is
apart for a frame, followed in either direction, before and after the turn: that is no jump, nor a way back."""

# `_Follower`: markers without a sample.
MOMENT = 3
"""Frames without a sample over which a marker's motion carries on. After more of them the body's shape alone judges it,
until it was there in `FOR_A_MOTION` frames."""
FOR_A_MOTION = 2
"""Places that make a motion."""


@dataclass(frozen=True)
class Gate:
    """A sample fits if it is off by less than `floor_px`, or than `deviations` times its expected spread."""

    floor_px: float
    deviations: float

    def limit_px(self, spread_px: np.ndarray) -> np.ndarray:
        """Return how far a sample may be off, px, where it is expected with such standard deviations, px."""
        return np.maximum(self.floor_px, self.deviations * spread_px)

    def score(self, gaussian: JointGaussian, deviation: np.ndarray, active: np.ndarray) -> np.ndarray:
        """Return (..., m) distance over what is allowed, 0 where not active; above 1 a sample does not fit."""
        distance, spread = gaussian.leave_one_out(deviation, active)
        return np.hypot(distance[..., 0], distance[..., 1]) / self.limit_px(spread)

    def allowed_px(self, gaussian: JointGaussian, active: np.ndarray) -> np.ndarray:
        """Return (n, m) how far each marker may be from where the other active ones (n, m) of its frame put it."""
        spreads = np.empty(active.shape)
        for mask, frames in rows_alike(active):
            _, spread = gaussian.leave_one_out(np.zeros(2 * len(mask)), mask)
            spreads[frames] = np.where(mask, spread, gaussian.spread_given(mask))
        return self.limit_px(spreads)


@dataclass(frozen=True, eq=False)
class MotionTrack:
    """Result of following the markers."""

    active: np.ndarray  # (n, m) the samples that fit
    place_px: np.ndarray  # (n, m, 2) where the markers are; carried on where a sample does not fit


def fitting_shape(
    model: BodyModel, position_px: np.ndarray, present: np.ndarray, believed: np.ndarray, gate: Gate
) -> np.ndarray:
    """Return (n, m) the samples that fit the body's shape, of those present, each frame on its own.

    Its heading is taken from the believed ones (n, m).
    """
    deviation = model.to_body(position_px, model.pose(position_px, believed))  # (n, 2m)
    active = present.copy()
    for _ in range(active.shape[1]):
        score = np.zeros(active.shape)
        for mask, frames in rows_alike(active):
            score[frames] = gate.score(model.shape_and_pose, deviation[frames], mask)
        out = np.flatnonzero(score.max(axis=1) > 1)
        if not len(out):
            break
        active[out, score[out].argmax(axis=1)] = False
    return active


def motion_spread(position_px: np.ndarray, active: np.ndarray) -> np.ndarray:
    """Return (m,) how far a marker usually is from where its last two places carry on to, in each coordinate, px.

    A tail that hurries through the middle and turns round sharply is off most where it turns, in a tenth of the frames
    or more; jumps of faulty tracks, as often, are no motion.
    """
    change = np.linalg.norm(np.diff(position_px, n=2, axis=0), axis=2)  # (n - 2, m)
    usable = active[2:] & active[1:-1] & active[:-2]
    spread = np.full(active.shape[1], 3.0 * LEAST_SPREAD_PX)
    for k in np.flatnonzero(usable.sum(axis=0) >= 10):
        middle, high = np.quantile(change[usable[:, k], k], (0.5, 0.9)) / (RAYLEIGH_MEDIAN, RAYLEIGH_90)
        spread[k] = min(max(middle, high), TURNS * max(middle, LEAST_SPREAD_PX))
    return np.maximum(spread, LEAST_SPREAD_PX)


def follow(
    model: BodyModel,
    time_s: np.ndarray,
    position_px: np.ndarray,
    present: np.ndarray,
    start: np.ndarray,
    gate: Gate,
) -> MotionTrack:
    """Follow the markers at (n, m, 2) through a trial in the order given; times (n,) may run in either direction.

    Only samples that are present (n, m) are judged; from those in `start` (n, m), which fit the body's shape, it begins
    where there is no motion to go by yet.
    """
    follower = _Follower(model, gate, motion_spread(position_px, start))
    active, place_px = start.copy(), np.empty_like(position_px)
    shape_only = model.pose(position_px, start)
    known = model.to_body(position_px, shape_only)
    ahead = np.ones(len(time_s))
    ahead[2:] = np.diff(time_s)[1:] / np.diff(time_s)[:-1]
    for t in range(len(time_s)):
        if t >= 2 and ahead[t] <= AT_MOST_AHEAD:
            carried = place_px[t - 1] + ahead[t] * (place_px[t - 1] - place_px[t - 2])
            mask, place = follower.step(position_px[t], carried, present[t])
            if 2 * mask.sum() > present[t].sum():
                active[t], place_px[t] = mask, place
                continue
        filled = model.shape_and_pose.expected(known[t], start[t])
        place_px[t] = model.to_image(filled[None], shape_only[t : t + 1])[0]
        follower.forget()
    return MotionTrack(active, place_px)


class _Expectation(NamedTuple):
    """Matrices for one set of active markers (m,), which deviations (2m,), px, are multiplied by as rows.

    Attributes:
        by_shape, by_motion: (2m, 2m) to the distance of each active marker from where the shape, or motion, puts it.
        per_shape, per_motion: (m,) one over the limit of these distances, 1/px.
        others: (2m, 2m) to what the active markers let expect of all.
        gain: (2m, 2m) Kalman gain of the places: multiplied from the left by the innovation (2m,).
    """

    by_shape: np.ndarray
    per_shape: np.ndarray
    by_motion: np.ndarray
    per_motion: np.ndarray
    others: np.ndarray
    gain: np.ndarray


class _Follower:
    """One step of following; keeps how far each marker last was from where the others put it."""

    def __init__(self, model: BodyModel, gate: Gate, motion_px: np.ndarray) -> None:
        m = len(motion_px)
        self.model, self.gate = model, gate
        by_motion = np.diag(1 / np.repeat(motion_px, 2) ** 2)  # (2m, 2m) precision
        self.spread = np.linalg.inv(np.linalg.inv(model.shape_and_pose.covariance) + by_motion)
        self.share = self.spread @ by_motion  # (2m, 2m) share of the motion model in what is expected
        self.expected = JointGaussian(self.spread + BOX_SD_PX**2 * np.eye(2 * m))
        self.pose_from = model.pose_from(np.ones(m, dtype=bool))
        self.expectations: dict[bytes, _Expectation] = {}
        self.forget()

    def forget(self) -> None:
        """Forget all frames and start anew."""
        self.own = np.zeros((len(self.model.place_px), 2))
        self.gone = np.zeros(len(self.own), int)  # (m,) frames since each marker had a sample
        self.strange = np.zeros(len(self.own), int)  # (m,) frames until the motion of each is known again

    def step(
        self, position_px: np.ndarray, carried_px: np.ndarray, present: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (m,) the samples that fit and (m, 2) the places of all markers.

        `carried_px` (m, 2) is where the places of the last two frames carry on to; those present (m,) are judged.
        """
        pose = self.pose_from @ carried_px.ravel()
        body = self.model.in_pose(pose)
        sample, carried = body.to_body(position_px), body.to_body(carried_px)  # (2m,)
        expected = self.share @ carried
        self.strange[present & (self.gone > MOMENT)] = FOR_A_MOTION
        active = self._agreeing(sample, sample - expected, present)
        given = self._given(active)
        missed = ~present & (self.gone < MOMENT)  # its motion carries on
        self.gone = np.where(present, 0, self.gone + 1)
        self.strange = np.maximum(self.strange - active, 0)

        place = (expected + given.gain @ (sample - expected)).reshape(-1, 2)
        fading = np.where(missed, 1.0, FADE)[:, None] * self.own
        self.own = np.where(active[:, None], (sample @ given.by_shape).reshape(-1, 2), fading)
        others = (sample @ given.others).reshape(-1, 2) + self.own
        place = np.where((active | missed)[:, None], place, others)
        return active, body.to_image(place.ravel())

    def _agreeing(self, from_shape: np.ndarray, from_expected: np.ndarray, present: np.ndarray) -> np.ndarray:
        active = present.copy()
        while active.any():
            given = self._given(active)
            off_shape, off_motion = from_shape @ given.by_shape, from_expected @ given.by_motion  # (2m,)
            by_shape = np.hypot(off_shape[::2], off_shape[1::2]) * given.per_shape
            by_motion = np.hypot(off_motion[::2], off_motion[1::2]) * given.per_motion
            by_motion[self.strange > 0] = 0.0
            if by_shape.max() <= 1 and by_motion.max() <= 1:
                break
            active[np.hypot(by_shape, by_motion).argmax()] = False
        return active

    def _given(self, active: np.ndarray) -> _Expectation:
        key = active.tobytes()
        if key not in self.expectations:
            shape, limit_px, none = self.model.shape_and_pose, self.gate.limit_px, np.zeros(2 * len(active))
            self.expectations[key] = _Expectation(
                shape.distances_of(active),
                1 / limit_px(shape.leave_one_out(none, active)[1]),
                self.expected.distances_of(active),
                1 / limit_px(self.expected.leave_one_out(none, active)[1]),
                shape.given(active)[0] @ shape.covariance,
                self.spread @ self.expected.given(active)[0],
            )
        return self.expectations[key]


# What both directions of time agree on.


def misplaced(
    model: BodyModel,
    time_s: np.ndarray,
    position_px: np.ndarray,
    present: np.ndarray,
    start: np.ndarray,
    gate: Gate,
) -> np.ndarray:
    """Find samples (n, m) that fit in neither direction of time, and stretches that both enclose; as for `follow`."""
    ahead = follow(model, time_s, position_px, present, start, gate)
    back = follow(model, -time_s[::-1], position_px[::-1], present[::-1], start[::-1], gate)
    back = MotionTrack(back.active[::-1], back.place_px[::-1])
    wrong = present & ~ahead.active & ~back.active
    for k in range(position_px.shape[1]):
        for first, last in _enclosed(k, position_px, present, ahead, back):
            wrong[first : last + 1, k] |= present[first : last + 1, k]
    return wrong


def clashing(model: BodyModel, position_px: np.ndarray, active: np.ndarray, least_px: np.ndarray) -> np.ndarray:
    """Find (n, m) of two active markers on one spot the one that is further from its place; both if that is not clear.

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
    """Return (n, m) `wrong`, extended along the frames that are `off` and across gaps of up to `join` frames."""
    wide = wrong.copy()
    for k in range(wrong.shape[1]):
        for first, last in stretches(off[:, k] | wrong[:, k]):
            wide[first : last + 1, k] |= wrong[first : last + 1, k].any()
        for (_, before), (after, _) in pairwise(stretches(wide[:, k])):
            wide[before:after, k] |= after - before <= join + 1
    return wide


def reaching(mask: np.ndarray, off_px: np.ndarray, least_px: float) -> np.ndarray:
    """Return (n, m) the stretches of `mask` in which a marker gets this far from where the others put it."""
    reach = np.zeros_like(mask)
    for k in range(mask.shape[1]):
        for first, last in stretches(mask[:, k]):
            reach[first : last + 1, k] = off_px[first : last + 1, k].max() >= least_px
    return reach


def _enclosed(
    k: int, position_px: np.ndarray, present: np.ndarray, ahead: MotionTrack, back: MotionTrack
) -> list[tuple[int, int]]:
    """Find the stretches of marker k that it enters by one jump and leaves by the opposite one.

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
