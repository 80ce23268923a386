"""Forward speed: the slope of the distance swum, over whole beats so that the beat itself does not tilt it."""

import numpy as np


def whole_beats(time_s: np.ndarray, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """(n,) mask of the longest run of whole beats from the first kept frame; all kept frames if not one beat fits."""
    if not kept.any():
        return kept
    start, end = time_s[kept][[0, -1]]
    frame = float(np.median(np.diff(time_s)))
    beats = np.floor((end - start + frame) * frequency_hz + 1e-6)
    if beats < 1:
        return kept
    return kept & (time_s < start + beats / frequency_hz - frame / 2 + 1e-9)


def forward_speed(time_s: np.ndarray, forward_m: np.ndarray, kept: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Least-squares slope of the distance swum over the whole beats within the kept frames.

    Args:
        time_s: (n,) s.
        forward_m: (..., n) distance along the head's own axis, forward positive, m.
        kept: (n,) which frames may be used.
        frequency_hz: beats a second.

    Returns:
        (...) m/s; nan where fewer than two frames are kept.
    """
    used = whole_beats(time_s, kept, frequency_hz)
    if used.sum() < 2:
        return np.full(forward_m.shape[:-1], np.nan)
    t = time_s[used] - time_s[used].mean()
    return (forward_m[..., used] @ t) / (t @ t)
