"""Check of a lens that is not calibrated by the robot itself: nose to neck is as long wherever in the picture it is.

`measure_distortion` measures the radial distortion by how that length changes over the picture. With the slopes t of
the rays, a lens shows t (1 + k1 |t|^2) (Brown, Photogrammetric Engineering 37, 1971), so a short piece at m along the
unit vector e appears longer by

    k1 (|m|^2 + 2 (m . e)^2).

A tilted camera shows lengths that change linearly over the picture: that is fitted beside it.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from swimcal.tracks import markers_of, pixels_of

_ROUNDS = 5  # rounds of Newton's method, and of undoing a distortion; of k1 -0.3 they leave a thousandth
_FEWEST = 60  # frames with nose and neck
_SHORTEST = 1e-6  # difference of slopes that still is a length
_STRONGEST = 0.3  # relative shift of the farthest marker beyond which a polynomial of one term is no lens
_FEWEST_TIMES = 8.0  # times that the errors must have changed for their size to be known


class MeasuredDistortion(NamedTuple):
    """Radial distortion of a lens, measured on one swim.

    Attributes:
        k1: relative shift of a point per squared slope of its ray, without a unit.
        sd: its standard deviation.
        farthest: slope of the ray of the marker that is farthest from the middle of the picture.
        over_swim: relative change of the length from nose to neck that it makes over the swim.
    """

    k1: float
    sd: float
    farthest: float
    over_swim: float

    @property
    def largest(self) -> float:
        """Largest size of k1 that the swim allows, two standard deviations off."""
        return abs(self.k1) + 2 * self.sd

    @property
    def stretch(self) -> float:
        """Relative stretch along the radius that this leaves at the farthest marker: the derivative of t + k1 t^3."""
        return 3 * self.largest * self.farthest**2


def measure_distortion(tracks: xr.Dataset, picture_px: tuple[int, int], half_width: float) -> MeasuredDistortion | None:
    """Measure the radial distortion by the length from nose to neck over the picture; None where too little is seen.

    Args:
        tracks: tracks, with confidence 0 where a sample must not be trusted.
        picture_px: width and height of the picture.
        half_width: half the width of the picture over the focal length.
    """
    if not {"nose", "neck"} <= set(markers_of(tracks)):
        return None
    middle = (np.array(picture_px) - 1) / 2
    trusted = np.where(tracks.confidence.values[..., None] > 0, pixels_of(tracks), np.nan)
    slopes = (trusted - middle) / (picture_px[0] / 2) * half_width
    nose, neck = (slopes[:, markers_of(tracks).index(name)] for name in ("nose", "neck"))
    seen = np.hypot(*(nose - neck).T) > _SHORTEST  # False where one is not seen
    if seen.sum() < _FEWEST:
        return None
    ends, k1, farthest = np.stack([nose[seen], neck[seen]]), 0.0, float(np.nanmax(np.hypot(*slopes.reshape(-1, 2).T)))
    for _ in range(_ROUNDS):
        columns, off = _undo_distortion(ends, k1)
        moments = columns.T @ columns
        if np.linalg.cond(moments) > 1 / np.finfo(float).eps:  # a fish on the spot
            return None
        weights = np.linalg.solve(moments, columns.T @ off)
        k1 += float(weights[0])
        if abs(k1) * farthest**2 > _STRONGEST:  # these are no lengths of one robot
            return None
    off = off - columns @ weights
    lasting = correlated_frames(off)
    if len(off) < _FEWEST_TIMES * lasting:
        return None
    sd = float(np.sqrt(np.linalg.inv(moments)[0, 0] * lasting * (off**2).mean()))
    return MeasuredDistortion(k1, sd, farthest, abs(k1) * float(np.ptp(columns[:, 0])))


def _undo_distortion(ends: np.ndarray, k1: float) -> tuple[np.ndarray, np.ndarray]:
    """Undo a distortion, and return what more of it, a tilt and the size would change, (n, 4), and the ln lengths (n,).

    Args:
        ends: (2, n, 2) slopes of nose and neck.
        k1: the distortion to undo.
    """
    ideal = ends
    for _ in range(_ROUNDS):
        ideal = ends / (1 + k1 * (ideal**2).sum(axis=-1, keepdims=True))
    at, along = ideal.mean(axis=0), ideal[0] - ideal[1]
    length = np.hypot(*along.T)
    bent = (at**2).sum(axis=1) + 2 * ((at * along).sum(axis=1) / length) ** 2
    return np.column_stack([bent - bent.mean(), at - at.mean(axis=0), np.ones(len(at))]), np.log(length)


def correlated_frames(off: np.ndarray) -> float:
    """Compute the integrated autocorrelation time of residuals (n,), in frames, up to the first zero; 1 of zeros."""
    if not off.any():
        return 1.0
    spectrum = np.abs(np.fft.rfft(off, 2 * len(off))) ** 2
    correlation = np.fft.irfft(spectrum)[: len(off)]
    correlation = correlation / correlation[0]
    ends = np.flatnonzero(correlation <= 0)
    return float(1 + 2 * correlation[1 : ends[0] if len(ends) else len(off)].sum())
