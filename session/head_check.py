"""The check whether nose and neck were exchanged: the other markers then lie on the wrong side of the head.

Only distances are compared, so that neither a mirrored image nor a bent tail plays a part.
"""

import numpy as np
import xarray as xr

from session.session_file import HEAD_MARKERS
from session.tracks import markers_of, pixels_of

# A marker counts if it is nearer to one of nose and neck than to the other by this share of the distance between them.
_CLEAR = 0.5
# Nose and neck count as exchanged from this share of samples on the wrong side.
_MOSTLY = 0.8


def wrong_side_share(tracks: xr.Dataset, place_m: np.ndarray) -> float | None:
    """Compute the share of samples that are nearer to the wrong end of the head, nose or neck.

    None where no marker tells, or none is seen together with nose and neck.

    Args:
        tracks: n frames of m markers.
        place_m: (m, 2 or 3) places of the markers on the straight robot, m.
    """
    markers = markers_of(tracks)
    nose, neck = (markers.index(name) for name in HEAD_MARKERS)
    belongs = _nearer_nose(place_m[None, :, :2], nose, neck)[0]  # (m,) m
    tells = np.abs(belongs) > _CLEAR * np.linalg.norm(place_m[nose, :2] - place_m[neck, :2])
    tells[[nose, neck]] = False
    found = _nearer_nose(pixels_of(tracks), nose, neck)[:, tells]
    wrong = (found * belongs[tells] < 0)[np.isfinite(found)]
    return float(wrong.mean()) if wrong.size else None


def is_exchanged(tracks: xr.Dataset, place_m: np.ndarray) -> bool:
    """Return whether nose and neck are exchanged in most frames; arguments as for `wrong_side_share`."""
    return (wrong_side_share(tracks, place_m) or 0.0) > _MOSTLY


def _nearer_nose(place: np.ndarray, nose: int, neck: int) -> np.ndarray:
    """Compute (n, m) by how much each marker at (n, m, 2) is nearer to the nose than to the neck."""
    from_nose, from_neck = (np.linalg.norm(place - place[:, [head]], axis=2) for head in (nose, neck))
    return from_neck - from_nose
