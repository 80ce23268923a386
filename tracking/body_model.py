"""Where each marker belongs, given the others: a Gaussian model of the body's shape, learned from the trial.

A trial's boxes are placed by hand and seen in perspective, so no layout predicts them to a few pixels; but
over a trial the markers move together, and one that leaves its place breaks the pattern. The model is a mean
and a covariance of all marker coordinates about the layout, in axes that turn with the body; place, heading
and size of the body are free in every frame. It starts from the layout (rigid head; tail with some play at
its root, bent like a beam with random curvature, the prior of cubic smoothing splines: Wahba, Spline Models
for Observational Data, 1990, section 1.5) and is sharpened by the samples believed so far: expectation
maximisation with missing data under an inverse Wishart prior (Little and Rubin, Statistical Analysis with
Missing Data, 2019, section 11.2).

Positions are (n, m, 2) in pixels with y up; deviations (n, 2m), x0, y0, x1, y1, …, in the axes of the body.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

_Conditionals = dict[bytes, tuple[np.ndarray, np.ndarray]]

ROOT_PLAY = 0.15
"""Play of the tail's root against the head, in nose-neck lengths: the real tails sway by 20 px of 135."""
DIRECTION_SD_RAD = 0.35
"""Spread of the tail's direction at its root: of the order of its swing."""
BEND_SD_RAD = 0.85
"""Spread of the bend over a nose-neck length of tail: two neighbouring segments bend by 0.4 rad."""
JITTER = 0.022
"""Spread of a marker about this shape, in nose-neck lengths: 3 px of 135 in the clean real trials."""
PARALLAX = 0.2
"""Apparent shift for each metre that a marker sits above or below the others, in metres."""
PRIOR_FRAMES = 10.0
"""Weight of the layout against the trial, in frames."""
FREE_PX2 = 1e6
"""Variance of place, heading and size of the body: as good as free."""


@dataclass(frozen=True, eq=False)
class JointGaussian:
    """A zero-mean Gaussian over the coordinates x0, y0, x1, y1, … of m markers, of which any may be missing."""

    covariance: np.ndarray  # (2m, 2m)
    _given: _Conditionals = field(default_factory=dict, init=False, repr=False)

    def given(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (2m, 2m) precision, zero where not active; (m, 2, 2) variance of active ones given the others."""
        key = active.tobytes()
        if key not in self._given:
            m, on = len(active), np.flatnonzero(np.repeat(active, 2))
            precision = np.zeros_like(self.covariance)
            precision[np.ix_(on, on)] = np.linalg.inv(self.covariance[np.ix_(on, on)])
            own = precision.reshape(m, 2, m, 2)[np.arange(m), :, np.arange(m)]  # (m, 2, 2)
            spread = np.zeros((m, 2, 2))
            spread[active] = np.linalg.inv(own[active])
            self._given[key] = precision, spread
        return self._given[key]

    def leave_one_out(self, deviation: np.ndarray, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how far each active marker is from where the other active ones (m,) put it.

        If one marker of a frame is shifted, this is the maximum-likelihood estimate of its shift (Baarda's
        data snooping; Cook and Weisberg, Residuals and Influence in Regression, 1982, section 2.2).
        Deviations (..., 2m) from the mean may be anything finite where not active. (..., m, 2) distances, 0 where not
        active; (m,) their expected spread in each coordinate.
        """
        precision, spread = self.given(active)
        weighted = (deviation @ precision).reshape(*deviation.shape[:-1], -1, 1, 2)  # (..., m, 1, 2)
        return (weighted @ spread)[..., 0, :], np.sqrt((spread[:, 0, 0] + spread[:, 1, 1]) / 2)

    def distances_of(self, active: np.ndarray) -> np.ndarray:
        """Return the (2m, 2m) matrix by which deviations (..., 2m) give the distances of `leave_one_out`."""
        precision, spread = self.given(active)
        columns = precision.reshape(len(precision), -1, 1, 2)  # (2m, m, 1, 2)
        return (columns @ spread).reshape(precision.shape)

    def expected(self, deviation: np.ndarray, active: np.ndarray) -> np.ndarray:
        """Return (..., 2m) what the active markers let expect of all; active markers themselves unchanged."""
        return deviation @ self.given(active)[0] @ self.covariance

    def spread_given(self, active: np.ndarray) -> np.ndarray:
        """Return (m,) standard deviation of each marker in each coordinate once the active markers are known."""
        variance = np.diag(self.remaining(active)).reshape(-1, 2).mean(axis=1)
        return np.sqrt(np.maximum(variance, 1e-12))

    def remaining(self, active: np.ndarray) -> np.ndarray:
        """Return (2m, 2m) covariance that remains once the active markers are known."""
        return self.covariance - self.covariance @ self.given(active)[0] @ self.covariance


class BodyInPose(NamedTuple):
    """The body in the poses of frames (...), one or many.

    Attributes:
        place_px: (..., m, 2) the layout in the image.
        heading: (..., 2, 2) rotations: a row vector in the image times one is in the axes of the body.
        mean_px: (2m,) expected deviation from the layout, in these axes.
    """

    place_px: np.ndarray
    heading: np.ndarray
    mean_px: np.ndarray

    def to_body(self, position_px: np.ndarray) -> np.ndarray:
        """Return (..., 2m) deviations of positions (..., m, 2) from the mean, px; 0 where a sample is missing."""
        turned = (position_px - self.place_px) @ self.heading
        deviation = turned.reshape(*turned.shape[:-2], -1) - self.mean_px
        return np.where(np.isnan(deviation), 0.0, deviation)

    def to_image(self, deviation: np.ndarray) -> np.ndarray:
        """Return (..., m, 2) positions, px; the inverse of `to_body`."""
        place = (deviation + self.mean_px).reshape(*deviation.shape[:-1], -1, 2)
        return place @ np.swapaxes(self.heading, -1, -2) + self.place_px


@dataclass(frozen=True, eq=False)
class BodyModel:
    """The body's shape in one trial."""

    place_px: np.ndarray  # (m, 2) the layout at the size it has in the images, robot frame (x from nose to tail)
    mean_px: np.ndarray  # (2m,) expected deviation from it in the axes of the body
    covariance_px2: np.ndarray  # (2m, 2m) of the deviations about their mean

    @cached_property
    def moves(self) -> np.ndarray:
        """(2m, 4) what a shift in x and in y, a stretch and a turn do to the coordinates of the layout."""
        x, y = (self.place_px - self.place_px.mean(axis=0)).T / 100.0
        one, zero = np.ones_like(x), np.zeros_like(x)
        return np.array([[one, zero, x, -y], [zero, one, y, x]]).transpose(2, 0, 1).reshape(-1, 4)

    @cached_property
    def shape(self) -> JointGaussian:
        """The deviations about their mean once the pose is known."""
        return JointGaussian(self.covariance_px2)

    @cached_property
    def shape_and_pose(self) -> JointGaussian:
        """The deviations about their mean with place, heading and size of the body free."""
        return JointGaussian(self.covariance_px2 + FREE_PX2 * self.moves @ self.moves.T)

    def pose(self, position_px: np.ndarray, active: np.ndarray) -> np.ndarray:
        """Return the combination (n, 4) of `moves` that fits active samples (n, m), by generalised least squares."""
        flat = np.nan_to_num(position_px).reshape(len(position_px), -1)
        pose = np.zeros((len(flat), 4))
        for mask, frames in rows_alike(active):
            pose[frames] = flat[frames] @ self.pose_from(mask).T
        return pose

    def pose_from(self, active: np.ndarray) -> np.ndarray:
        """Return the (4, 2m) matrix that takes the positions of a frame to its pose."""
        weights = self.moves.T @ self.shape.given(active)[0]  # (4, 2m)
        return np.linalg.solve(weights @ self.moves + 1e-9 * np.eye(4), weights)

    def to_body(self, position_px: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Return (n, 2m) deviations of positions (n, m, 2) from the mean in poses (n, 4), px; 0 where missing."""
        return self.in_pose(pose).to_body(position_px)

    def to_image(self, deviation: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Return (n, m, 2) positions, px; the inverse of `to_body`."""
        return self.in_pose(pose).to_image(deviation)

    def in_pose(self, pose: np.ndarray) -> "BodyInPose":
        """Return the body in poses (..., 4), combinations of `moves`."""
        return BodyInPose((pose @ self.moves.T).reshape(*pose.shape[:-1], -1, 2), _heading(pose), self.mean_px)

    def put_by_others(self, position_px: np.ndarray, active: np.ndarray) -> np.ndarray:
        """Return (n, m, 2) where the active markers of a frame put each marker, itself left out."""
        pose = self.pose(position_px, active)
        deviation = self.to_body(position_px, pose)  # (n, 2m)
        put = np.empty_like(deviation)
        for mask, frames in rows_alike(active):
            others = self.shape_and_pose.expected(deviation[frames], mask)  # (f, 2m), right where not active
            distance, _ = self.shape_and_pose.leave_one_out(deviation[frames], mask)
            own = deviation[frames] - distance.reshape(others.shape)
            put[frames] = np.where(np.repeat(mask, 2), own, others)
        return self.to_image(put, pose)


def rows_alike(active: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the different rows of (n, m), each with the numbers of the rows that equal it."""
    rows = np.ascontiguousarray(active, bool).view((np.void, active.shape[1])).ravel()  # bytes sort far sooner
    _, first, which = np.unique(rows, return_index=True, return_inverse=True)
    for number, row in enumerate(first):
        yield active[row], np.flatnonzero(which == number)


def layout_model(place_m: np.ndarray, root_x_m: float, px_per_m: float, unit_m: float) -> BodyModel:
    """Build the model of the layout alone: markers (m, 3) of the straight robot, m, whose head ends at `root_x_m`.

    `px_per_m` is the size of the images, `unit_m` the way from nose to neck.
    """
    s = np.maximum(place_m[:, 0] - root_x_m, 0.0) / unit_m  # (m,) way along the tail
    near, far = np.minimum(s[:, None], s), np.maximum(s[:, None], s)  # (m, m)
    root = ROOT_PLAY**2 * np.outer(s > 0, s > 0) + DIRECTION_SD_RAD**2 * np.outer(s, s)
    bend = BEND_SD_RAD**2 * (near**2 * far / 2 - near**3 / 6)
    height = (place_m[:, 2] - np.median(place_m[:, 2])) / unit_m
    spread = root + bend + np.diag(JITTER**2 + (PARALLAX * height) ** 2)
    covariance = np.kron((unit_m * px_per_m) ** 2 * spread, np.eye(2))
    return BodyModel(place_m[:, :2] * px_per_m, np.zeros(len(covariance)), covariance)


def spacing_spread(place_m: np.ndarray, unit_m: float) -> np.ndarray:
    """Return (m, m) how far the distance between two neighbours may stray from the layout, standard deviation, m."""
    height = place_m[:, None, 2] - place_m[None, :, 2]
    return np.sqrt(2 * (JITTER * unit_m) ** 2 + (PARALLAX * height) ** 2)


def centred(model: BodyModel, position_px: np.ndarray, active: np.ndarray) -> BodyModel:
    """Move the model's mean to where most frames have it, from frames that have the same active markers.

    They are those with the largest set that a tenth of the frames have, or else the commonest. Each marker's
    usual distance from where the others put it is the mode over these frames, not the median: a box that sits
    in the wrong place for nearly half of a trial must not draw the mean half way.
    """
    groups = list(rows_alike(active))
    often = max(10, len(active) // 10)
    many = [group for group in groups if len(group[1]) >= often]
    mask, frames = max(many or groups, key=lambda group: (group[0].sum() if many else 0, len(group[1])))
    deviation = model.to_body(position_px[frames], model.pose(position_px[frames], active[frames]))  # (f, 2m)
    distance, spread = model.shape_and_pose.leave_one_out(deviation, mask)  # (f, m, 2), (m,)
    weights = np.zeros((len(mask), 2))
    for k in np.flatnonzero(mask):
        usual = mode(distance[:, k], width=max(4.0, spread[k]))
        weights[k] = np.linalg.solve(model.shape_and_pose.given(mask)[1][k], usual)
    return replace(model, mean_px=model.mean_px + model.covariance_px2 @ weights.ravel())


def mode(points: np.ndarray, width: float, steps: int = 10) -> np.ndarray:
    """Return (2,) the densest place among (n, 2) points: mean shift from their median (Comaniciu and Meer, 2002)."""
    centre = np.median(points, axis=0)
    for _ in range(steps):
        near = np.exp(-((points - centre) ** 2).sum(axis=1) / (2 * width**2))  # (n,)
        centre = (near @ points + 1e-12 * centre) / (near.sum() + 1e-12)
    return centre


def fit_body_model(prior: BodyModel, position_px: np.ndarray, active: np.ndarray, steps: int = 4) -> BodyModel:
    """Fit the prior to the active samples (n, m) at (n, m, 2), by expectation maximisation."""
    deviation = prior.to_body(position_px, prior.pose(position_px, active))  # (n, 2m)
    mean, covariance = np.zeros_like(prior.mean_px), prior.covariance_px2
    n = len(deviation)
    for _ in range(steps):
        shape = JointGaussian(covariance)
        filled, uncertain = np.empty_like(deviation), np.zeros_like(covariance)
        for mask, frames in rows_alike(active):
            filled[frames] = mean + shape.expected(deviation[frames] - mean, mask)
            uncertain += len(frames) * shape.remaining(mask)
        mean = filled.mean(axis=0)
        scatter = (filled - mean).T @ (filled - mean) + uncertain
        covariance = (scatter + PRIOR_FRAMES * prior.covariance_px2) / (n + PRIOR_FRAMES)
    return replace(prior, mean_px=prior.mean_px + mean, covariance_px2=covariance)


def _heading(pose: np.ndarray) -> np.ndarray:
    """Return (..., 2, 2) rotations of poses (..., 4): a row vector in the image times one is in the body's axes."""
    size = np.maximum(np.hypot(pose[..., 2], pose[..., 3]), 1e-9)
    cos, sin = pose[..., 2] / size, pose[..., 3] / size
    return np.stack([cos, -sin, sin, cos], axis=-1).reshape(*pose.shape[:-1], 2, 2)
