"""The head-frame normaliser: marker trajectories freed of where and how the swimmer started and turned.

"Simple Models, Real Swimming" (2026), data processing: in every frame all markers are rotated so that nose ->
neck is +x, with the nose as origin; to that each frame adds the nose's displacement since the frame before,
taken in the axes half-way between the two frames (the published code takes those of the later frame, which makes the
path depend on the frame rate). Forward is therefore -x, as in the robot frame.
"""

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True, eq=False)
class HeadFrame:
    """Markers in the head frame.

    Attributes:
        position_m: (..., n, m, 2) the published trajectory: shape plus accumulated displacement, m; where frames are
            said to be seen or not, told from the bridged head in the others.
        shape_m: (..., n, m, 2) relative to the nose in every frame, m.
        path_m: (..., n, 2) accumulated displacement of the head along its own axes, 0 in the first frame, m.
        heading_rad: (..., n) angle of nose -> neck in the pool, unwrapped, counter-clockwise seen from above; nan in
            frames without a trusted nose and neck, which path and nose bridge.
        nose_m: (..., n, 2) the nose in the pool, bridged, m.
    """

    position_m: np.ndarray
    shape_m: np.ndarray
    path_m: np.ndarray
    heading_rad: np.ndarray
    nose_m: np.ndarray

    @property
    def forward_m(self) -> np.ndarray:
        """(..., n) distance swum along the head's own axis, forward positive, m."""
        return -self.path_m[..., 0]


def to_head_frame(position_m: np.ndarray, nose: int, neck: int, seen: np.ndarray | None = None) -> HeadFrame:
    """Turn markers in the pool into markers in the head frame, for any number of trajectories at once.

    Args:
        position_m: (..., n, m, 2) markers in a right-handed frame fixed to the pool, z towards the camera, m.
            Frames in which nose or neck is missing (nan), or both are on one spot, are missing in the result; the
            displacement bridges them.
        nose: index of the marker on the nose.
        neck: index of the marker on the neck.
        seen: (n,) frames whose nose and neck may be trusted. In the others the head is bridged: displacement, nose and
            heading are, and `position_m` tells the other markers from there. Two trajectories that are compared need
            the same.
    """
    axis = _unit(position_m[..., neck, :] - position_m[..., nose, :])  # (..., n, 2)
    shape = _turn(position_m - position_m[..., nose : nose + 1, :], axis[..., None, :])  # (..., n, m, 2)

    trusted = np.isfinite(axis).all(axis=-1) & (True if seen is None else seen)  # (..., n)
    place = _bridged(np.where(trusted[..., None], position_m[..., nose, :], np.nan))  # (..., n, 2)
    heading = _unwrapped(np.where(trusted, np.arctan2(axis[..., 1], axis[..., 0]), np.nan))  # (..., n)
    steps = _turn(np.diff(place, axis=-2), _between(heading))  # (..., n - 1, 2)
    path = np.concatenate([np.zeros_like(place[..., :1, :]), np.cumsum(steps, axis=-2)], axis=-2)
    told = np.where(trusted, heading, np.nan)
    moved = shape + path[..., None, :]
    return HeadFrame(
        position_m=moved if seen is None else bridge_head(moved, position_m, place, told, path),
        shape_m=shape,
        path_m=path,
        heading_rad=told,
        nose_m=place,
    )


def bridge_head(
    moved_m: np.ndarray, position_m: np.ndarray, nose_m: np.ndarray, heading_rad: np.ndarray, path_m: np.ndarray
) -> np.ndarray:
    """Return markers (..., n, m, 2) in the head frame, in frames without a heading from the bridged head.

    Args:
        moved_m: (..., n, m, 2) markers in the head frame, where it is seen.
        position_m: (..., n, m, 2) markers in the pool.
        nose_m: (..., n, 2) the bridged nose in the pool.
        heading_rad: (..., n) headings; nan where nose or neck is not trusted.
        path_m: (..., n, 2) the bridged displacement.
    """
    known = np.isfinite(heading_rad)
    if known.all():
        return moved_m
    heading = _unwrapped(heading_rad)
    axis = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    bridged = _turn(position_m - nose_m[..., None, :], axis[..., None, :]) + path_m[..., None, :]
    return np.where(known[..., None, None], moved_m, bridged)


def select_head(heads: HeadFrame, index: int) -> HeadFrame:
    """Return one of several trajectories (s, n, m, 2)."""
    return HeadFrame(*(getattr(heads, part.name)[index] for part in fields(heads)))


def from_head_frame(head: HeadFrame) -> np.ndarray:
    """Return the markers (..., n, m, 2) in the pool again, m, up to a shift of it: the nose starts at 0."""
    heading = _unwrapped(head.heading_rad)
    back = np.stack([np.cos(heading), -np.sin(heading)], axis=-1)  # (..., n, 2)
    steps = _turn(np.diff(head.path_m, axis=-2), _between(heading) * np.array([1.0, -1.0]))
    place = np.concatenate([np.zeros_like(head.path_m[..., :1, :]), np.cumsum(steps, axis=-2)], axis=-2)
    return _turn(head.shape_m, back[..., None, :]) + place[..., None, :]


def _unit(vector: np.ndarray) -> np.ndarray:
    """Return (..., 2) of length 1; nan where there is no direction."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return vector / np.where(length > 0, length, np.nan)


def _between(heading_rad: np.ndarray) -> np.ndarray:
    """Return (..., n - 1, 2) unit vectors half-way between the headings (..., n) of neighbouring frames."""
    middle = 0.5 * (heading_rad[..., 1:] + heading_rad[..., :-1])
    return np.stack([np.cos(middle), np.sin(middle)], axis=-1)


def _turn(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return (..., 2) components of a vector along the unit `axis` and along the axis a quarter turn to its left."""
    along = vector[..., 0] * axis[..., 0] + vector[..., 1] * axis[..., 1]
    across = vector[..., 1] * axis[..., 0] - vector[..., 0] * axis[..., 1]
    return np.stack([along, across], axis=-1)


def _bridged(series: np.ndarray) -> np.ndarray:
    """Return (..., n, c) with missing samples interpolated linearly in time, held constant at the ends."""
    if np.isfinite(series).all():
        return series
    flat = series.reshape(-1, *series.shape[-2:]).copy()
    frames = np.arange(series.shape[-2])
    for one in flat:
        known = np.isfinite(one).all(axis=1)
        if known.any():
            for column in range(one.shape[1]):
                one[:, column] = np.interp(frames, frames[known], one[known, column])
    return flat.reshape(series.shape)


def _unwrapped(angle: np.ndarray) -> np.ndarray:
    """Return (..., n) without jumps of a whole turn; missing samples are interpolated between the others."""
    if np.isfinite(angle).all():
        return np.unwrap(angle, axis=-1)
    flat = angle.reshape(-1, angle.shape[-1]).copy()
    for one in flat:
        known = np.isfinite(one)
        one[known] = np.unwrap(one[known])
    return _bridged(flat[..., None])[..., 0].reshape(angle.shape)
