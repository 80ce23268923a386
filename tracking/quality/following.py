"""Following the markers from frame to frame: each sample against the body's shape and against its own motion.

The prediction and the gate of a Kalman filter in their plainest form. A marker is expected where its last two
places carry on to and where the other markers put it, combined by their precisions; of the samples of a
frame the worst is left out until the rest agree. The place of one that is left out is carried on from the
others, so that a fault that lasts stays apart. Motion decides what shape alone cannot: which of three markers
on a rigid line has moved.
"""

from dataclasses import dataclass

import numpy as np

from tracking.quality.body_model import BodyModel, JointGaussian, rows_alike

FADE = 0.97
"""What a frame leaves of a left-out marker's last known distance from where the others put it."""
RAYLEIGH_MEDIAN = np.sqrt(2 * np.log(2))
"""Median length of a vector whose two coordinates are normal with standard deviation 1."""
AT_MOST_AHEAD = 2.5
"""Motion carries on over a time step no longer than this many times the one before."""
BOX_SD_PX = 1.0
"""Spread of a box about its marker in each coordinate (boxes are whole pixels, their centres half ones)."""


@dataclass(frozen=True)
class Gate:
    """A sample fits if it is off by less than `floor_px`, or than `deviations` times its expected spread."""

    floor_px: float
    deviations: float

    def score(self, gaussian: JointGaussian, deviation: np.ndarray, active: np.ndarray) -> np.ndarray:
        """(..., m) distance over what is allowed, 0 where not active; above 1 a sample does not fit."""
        distance, spread = gaussian.leave_one_out(deviation, active)
        allowed = np.maximum(self.floor_px, self.deviations * spread)
        return np.hypot(distance[..., 0], distance[..., 1]) / allowed

    def allowed_px(self, gaussian: JointGaussian, active: np.ndarray) -> np.ndarray:
        """(n, m) how far each marker may be from where the active ones (n, m) of its frame put it, itself left out."""
        allowed = np.empty(active.shape)
        for mask, frames in rows_alike(active):
            _, spread = gaussian.leave_one_out(np.zeros(2 * len(mask)), mask)
            allowed[frames] = self.deviations * np.where(mask, spread, gaussian.spread_given(mask))
        return np.maximum(self.floor_px, allowed)


@dataclass(frozen=True, eq=False)
class MotionTrack:
    """What following found."""

    active: np.ndarray  # (n, m) the samples that fit
    place_px: np.ndarray  # (n, m, 2) where the markers are; carried on where a sample does not fit


def fitting_shape(
    model: BodyModel, position_px: np.ndarray, present: np.ndarray, believed: np.ndarray, gate: Gate
) -> np.ndarray:
    """(n, m) the samples that fit the body's shape, of those present, each frame on its own.

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


def motion_spread(position_px: np.ndarray, active: np.ndarray, least_px: float = 1.0) -> np.ndarray:
    """(m,) how far a marker usually is from where its last two places carry on to, in each coordinate, px."""
    change = np.linalg.norm(np.diff(position_px, n=2, axis=0), axis=2)  # (n - 2, m)
    usable = active[2:] & active[1:-1] & active[:-2]
    spread = np.full(active.shape[1], 3.0 * least_px)
    for k in np.flatnonzero(usable.sum(axis=0) >= 10):
        spread[k] = np.median(change[usable[:, k], k]) / RAYLEIGH_MEDIAN
    return np.maximum(spread, least_px)


def follow(
    model: BodyModel,
    time_s: np.ndarray,
    position_px: np.ndarray,
    present: np.ndarray,
    start: np.ndarray,
    gate: Gate,
) -> MotionTrack:
    """Follows the markers at (n, m, 2) through a trial in the order given; times (n,) may run in either direction.

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
        self.forget()

    def forget(self) -> None:
        """Starts anew."""
        self.own = np.zeros((len(self.model.place_px), 2))

    def step(
        self, position_px: np.ndarray, carried_px: np.ndarray, present: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(m,) the samples that fit and (m, 2) the places of all markers.

        `carried_px` (m, 2) is where the places of the last two frames carry on to; those present (m,) are judged.
        """
        model = self.model
        pose = (self.pose_from @ carried_px.ravel())[None]
        both_px = np.stack([position_px, carried_px])  # (2, m, 2)
        sample, carried = model.to_body(both_px, np.repeat(pose, 2, axis=0))  # (2m,) each
        expected = self.share @ carried
        active = self._agreeing(sample, sample - expected, present)

        place = expected + self.spread @ (self.expected.given(active)[0] @ (sample - expected))
        others = model.shape_and_pose.expected(sample, active).reshape(-1, 2)
        distance, _ = model.shape_and_pose.leave_one_out(sample, active)
        self.own = np.where(active[:, None], distance, FADE * self.own)
        place = np.where(active[:, None], place.reshape(-1, 2), others + self.own)
        return active, model.to_image(place.ravel()[None], pose)[0]

    def _agreeing(self, from_shape: np.ndarray, from_expected: np.ndarray, present: np.ndarray) -> np.ndarray:
        active = present.copy()
        while active.any():
            by_shape = self.gate.score(self.model.shape_and_pose, from_shape, active)
            by_motion = self.gate.score(self.expected, from_expected, active)
            if max(by_shape.max(), by_motion.max()) <= 1:
                break
            active[np.hypot(by_shape, by_motion).argmax()] = False
        return active
