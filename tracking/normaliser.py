"""The head-frame normaliser: marker trajectories freed of where and how the swimmer started and turned.

"Simple Models, Real Swimming" (2026), data processing: in every frame all markers are rotated so that nose ->
neck is +x, with the nose as origin; to that each frame adds the nose's displacement since the frame before,
taken in the axes of that frame. Forward is therefore -x, as in the robot frame.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class HeadFrame:
    """Markers in the head frame.

    Attributes:
        position_m: (..., n, m, 2) the published trajectory: shape plus accumulated displacement, m.
        shape_m: (..., n, m, 2) relative to the nose in every frame, m.
        path_m: (..., n, 2) accumulated displacement of the head along its own axes, 0 in the first frame, m.
        heading_rad: (..., n) angle of nose -> neck in the pool, unwrapped, counter-clockwise seen from above.
    """

    position_m: np.ndarray
    shape_m: np.ndarray
    path_m: np.ndarray
    heading_rad: np.ndarray

    @property
    def forward_m(self) -> np.ndarray:
        """(..., n) distance swum along the head's own axis, forward positive, m."""
        return -self.path_m[..., 0]


def to_head_frame(position_m: np.ndarray, nose: int, neck: int) -> HeadFrame:
    """Markers in the pool -> markers in the head frame, for any number of trajectories at once.

    Args:
        position_m: (..., n, m, 2) markers in a right-handed frame fixed to the pool, z towards the camera, m.
            Frames in which nose or neck is missing (nan), or both are on one spot, are missing in the result; the
            displacement bridges them.
        nose, neck: index of the marker.
    """
    axis = _unit(position_m[..., neck, :] - position_m[..., nose, :])  # (..., n, 2)
    shape = _turn(position_m - position_m[..., nose : nose + 1, :], axis[..., None, :])  # (..., n, m, 2)

    place = _bridged(position_m[..., nose, :])  # (..., n, 2)
    steps = _turn(np.diff(place, axis=-2), _unit(_bridged(axis))[..., 1:, :])  # (..., n - 1, 2)
    path = np.concatenate([np.zeros_like(place[..., :1, :]), np.cumsum(steps, axis=-2)], axis=-2)
    angle = np.arctan2(axis[..., 1], axis[..., 0])  # (..., n)
    return HeadFrame(
        position_m=shape + path[..., None, :],
        shape_m=shape,
        path_m=path,
        heading_rad=_unwrapped(angle),
    )


def _unit(vector: np.ndarray) -> np.ndarray:
    """(..., 2) of length 1; nan where there is no direction."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return vector / np.where(length > 0, length, np.nan)


def one_of(heads: HeadFrame, index: int) -> HeadFrame:
    """One of several trajectories (s, n, m, 2)."""
    return HeadFrame(heads.position_m[index], heads.shape_m[index], heads.path_m[index], heads.heading_rad[index])


def from_head_frame(head: HeadFrame) -> np.ndarray:
    """Back to the pool, up to a shift of it: (..., n, m, 2) markers, m, with the nose starting at 0."""
    axis = np.stack([np.cos(head.heading_rad), np.sin(head.heading_rad)], axis=-1)  # (..., n, 2)
    turned_back = axis * np.array([1.0, -1.0])
    steps = _turn(np.diff(head.path_m, axis=-2), turned_back[..., 1:, :])
    place = np.concatenate([np.zeros_like(head.path_m[..., :1, :]), np.cumsum(steps, axis=-2)], axis=-2)
    return _turn(head.shape_m, turned_back[..., None, :]) + place[..., None, :]


def _turn(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(..., 2) components of a vector along the unit `axis` and along the axis a quarter turn to its left."""
    along = vector[..., 0] * axis[..., 0] + vector[..., 1] * axis[..., 1]
    across = vector[..., 1] * axis[..., 0] - vector[..., 0] * axis[..., 1]
    return np.stack([along, across], axis=-1)


def _bridged(series: np.ndarray) -> np.ndarray:
    """(..., n, 2) with missing samples interpolated linearly in time, held constant at the ends."""
    if np.isfinite(series).all():
        return series
    flat = series.reshape(-1, series.shape[-2], 2).copy()
    frames = np.arange(series.shape[-2])
    for one in flat:
        known = np.isfinite(one).all(axis=1)
        if known.any():
            for column in range(2):
                one[:, column] = np.interp(frames, frames[known], one[known, column])
    return flat.reshape(series.shape)


def _unwrapped(angle: np.ndarray) -> np.ndarray:
    """(..., n) without jumps of a whole turn; missing samples stay missing."""
    turns = _bridged(np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    whole = np.unwrap(np.arctan2(turns[..., 1], turns[..., 0]), axis=-1)
    return np.where(np.isfinite(angle), whole, np.nan)
