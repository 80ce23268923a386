"""The part of a trial in which the tail beats: robots rest before they start, stop early, or never start."""

import numpy as np

_HOP = 0.25  # part of a beat between windows of one beat
_BEATING = 0.4  # least share of the usual amplitude; a window that is half at rest has about half of it
_USUAL = 80.0  # percentile of the windows that counts as usual
_LEAST_SEEN = 0.5  # share of a window's frames in which a marker has to be seen
_JUDGED = 3.0  # least number of beats, so that one can be at rest without being most of them


def beating_part(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, hz: float) -> slice:
    """Return the frames of the longest stretch in which the tail beats throughout.

    Each marker's amplitude in windows of one beat is compared with what it usually is. A window that does not show the
    tail says nothing.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) sideways motion of k tail markers in the head frame, m.
        weight: (n, k) of each sample, 0 leaves it out.
        hz: beats a second.

    Returns:
        All frames where the tail beats from the first to the last, or in a trial of fewer than three beats.
    """
    whole, period_s = slice(0, len(time_s)), 1 / hz
    if np.ptp(time_s) < _JUDGED * period_s:
        return whole
    middles_s = np.arange(time_s[0] + period_s / 2, time_s[-1] - period_s / 2 + 1e-9, _HOP * period_s)
    amplitude = np.array([_amplitude(time_s, lateral_m, weight, hz, middle_s) for middle_s in middles_s])  # (w, k)
    seen = np.isfinite(amplitude)
    if not seen.any():
        return whole
    usual = np.array([np.percentile(own[own == own], _USUAL) if (own == own).any() else np.nan for own in amplitude.T])
    ratio = np.array([np.median(own[mask]) if (mask := np.isfinite(own)).any() else 1.0 for own in amplitude / usual])
    beats = np.flatnonzero(np.diff(np.pad(ratio >= _BEATING, 1).astype(int))).reshape(-1, 2)
    if not len(beats):
        return whole
    first, end = beats[int(np.argmax(beats[:, 1] - beats[:, 0]))]
    begins_s = time_s[0] if first == 0 else middles_s[first]
    ends_s = time_s[-1] if end == len(ratio) else middles_s[end - 1]
    frames = np.flatnonzero((time_s >= begins_s - 1e-9) & (time_s <= ends_s + 1e-9))
    return slice(int(frames[0]), int(frames[-1]) + 1)


def _amplitude(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, hz: float, middle_s: float) -> np.ndarray:
    """Return the amplitude of each marker's first harmonic in the beat about a time (k,), m; nan where hardly seen."""
    frames = np.abs(time_s - middle_s) <= 0.5 / hz + 1e-9
    angle = 2 * np.pi * hz * time_s[frames]
    columns, found = (
        np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)]),
        np.full(len(weight[0]), np.nan),
    )
    for marker in range(len(found)):
        good = (weight[frames, marker] > 0) & np.isfinite(lateral_m[frames, marker])
        if good.mean() >= _LEAST_SEEN and good.sum() > 3:
            fitted = np.linalg.lstsq(columns[good], lateral_m[frames, marker][good], rcond=None)[0]
            found[marker] = np.hypot(fitted[1], fitted[2])
    return found
