"""Filling of gaps: short stretches without a sample, from the other markers and from before and after.

A beating tail turns round within a gap of a few frames, and interpolation in time does not see it. The other markers
do. So a missing marker is put where the markers that are seen throughout the gap put it, by a regression over the
frames near it in which all of them are seen, and what this is off by at the ends of the gap is carried over it
linearly. The others of a moment before and after count too: a wave runs along the tail, and its end follows the rest.
Positions are complex numbers and so are the weights: a complex factor turns and stretches, and the regression holds for
every place and heading of the body.

Where too few other markers are seen, a cubic spline in time is left. Which of them fills a gap, and whether it may, is
rehearsed: each fills gaps of the same length that are cut into samples of the same marker.

Error on the twin's swim trials at 1.00, 1.75 and 2.25 Hz with 950 px a metre and 0.15 px noise (RMS an axis, px, as in
`tests/tracking/records/test_gaps.py`):

| missing for                       | 3 frames | 7 frames | 15 frames | 30 frames |
|-----------------------------------|----------|----------|-----------|-----------|
| tail_5, from the others           | 0.2      | 0.2      | 0.2       | 0.2       |
| tail_4 and tail_5, from the rest  | 0.3      | 0.3      | 0.3       | 0.3       |
| caudal_fin, from the others       | 0.4      | 0.8      | 0.9       | 0.9       |
| tail_5 and caudal_fin             | 0.4      | 1.2      | 1.2       | 1.2       |
| all at once, in time              | 0.3      | 1.1      | 5.7       | 21        |
| tail_5, cubic in time, to compare | 0.3      | 1.2      | 7.5       | 17        |
| tail_5, PCHIP in time, to compare | 0.7      | 3.0      | 13        | 19        |

On the five public trials, in gaps of 14 frames cut into samples that the quality checks believe, the error is 0.6 to
1.7 px for tail_1, tail_4 and tail_5 (linear in time: 0.7 to 6.2 px) and 1.1 to 3.2 px for the caudal fin (1.5 to 14),
the jitter of the public boxes included.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from threadpoolctl import threadpool_limits

from swimcal.flags import Flag
from swimcal.tracks import markers_of, pixels_of
from tracking.harmed_frames import stretches
from tracking.tracked import SampleState, drop_repeat_flags, samples_of, seen_in, with_samples

REACH_FRAMES = 300
"""Frames before and after a gap that it is filled from: some beats, the slowest included."""
NEAR_FRAMES = 12
"""Samples on each side of a gap that a spline in time goes through."""
LAG_S = 0.05
"""Let the other markers count for so long before and after a frame."""
END_FRAMES = 3
"""Samples on each side of a gap whose mean is what the other markers are off by there."""
NOISE_PX = 0.2
"""Noise of a coordinate that the regression allows for; keeps it from leaning on markers on one line (ridge)."""
FRAMES_PER_WEIGHT = 5
"""Fewest frames for each weight of the regression."""
REHEARSALS = 12
"""Gaps of the same length that a method is rehearsed on, at most; a third of them must be possible."""
LONGEST_S = 0.25
"""The longest gap that is filled, from the last sample before it to the first after it."""
WORST_PX = 3.0
"""The largest error in rehearsals, RMS an axis; suits the public trials (60 frames a second, about 950 px a metre)."""
CONFIDENCE = 0.5
"""Confidence of a filled sample right next to samples of confidence 1; below 1 since it measures nothing."""
HALVES_S = 0.1
"""Distance in time from the nearest sample over which the confidence of a filled one halves."""


class GapFill(NamedTuple):
    """Fill of one gap of f frames, and its expected error."""

    place: np.ndarray  # (f,) complex positions x + i y, px
    error_px: float  # RMS an axis in rehearsals


def fill_gaps(tracked: xr.Dataset) -> xr.Dataset:
    """Fill the gaps that are short enough and can be filled well enough.

    A gap is a stretch of a marker without samples that are measured or set by hand; it is taken from those alone, so
    filling twice is the same as once. A filled sample is INTERPOLATED; other samples stay bit for bit. A gap that is
    not filled stays as it is, is flagged ``gap`` and the flag states why: it is longer than the limit, has no sample on
    one side, or could only be guessed. Earlier flags of this kind are replaced.
    """
    time_s, seen = tracked.time.values, seen_in(tracked)
    place = pixels_of(tracked) @ np.array([1, 1j])  # (n, m)
    samples = samples_of(tracked)
    flags = [flag for flag in tracked.flags if flag.kind != "gap"]
    spans = [(k, slice(first, last + 1)) for k in range(seen.shape[1]) for first, last in stretches(~seen[:, k])]
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        answers = [_fill(time_s, place, seen, k, span) for k, span in spans]
    for (k, span), (filling, why) in zip(spans, answers, strict=True):
        if filling is None:
            marker, count = markers_of(tracked)[k], span.stop - span.start
            frames = "1 frame" if count == 1 else f"{count} frames"
            message = f"{marker} is not seen in {frames}: {why}"
            flags.append(Flag("gap", (marker,), (span.start, span.stop - 1), message))
            continue
        filled = samples[span, k]
        filled["position_px"] = np.stack([filling.place.real, filling.place.imag], axis=1)
        filled["confidence"] = _confidence(time_s, tracked.confidence.values[:, k], span)
        filled["state"], filled["size_px"] = SampleState.INTERPOLATED, np.nan
    return with_samples(tracked, samples, drop_repeat_flags(tracked, flags))


def _fill(time_s: np.ndarray, place: np.ndarray, seen: np.ndarray, k: int, span: slice) -> tuple[GapFill | None, str]:
    """Return the fill of the gap `span` of marker k, or None and the reason why it stays open."""
    if span.start == 0 or span.stop == len(time_s):
        return None, "there is no sample on one side of it"
    long_s = time_s[span.stop] - time_s[span.start - 1]
    if long_s > LONGEST_S + 1e-9:  # time stamps are rounded
        return None, f"{long_s:.2f} s, and gaps are filled up to {LONGEST_S:g} s"
    first = max(span.start - REACH_FRAMES, 0)
    near, gap = slice(first, span.stop + REACH_FRAMES), slice(span.start - first, span.stop - first)
    time_s, place, seen = time_s[near], place[near], seen[near]
    lag = max(1, round(LAG_S / np.median(np.diff(time_s))))
    in_time = _in_time(time_s, place[:, k], seen[:, k], gap)
    others = _from_others(time_s, place, seen, k, gap, lag) or _from_others(time_s, place, seen, k, gap, 0)
    best = min(filter(None, (in_time, others)), key=lambda filling: filling.error_px, default=None)
    if best is None:
        return None, "too few samples elsewhere to tell how well it could be filled"
    if best.error_px > WORST_PX:
        return None, f"it could be filled to {best.error_px:.1f} px only, and {WORST_PX:g} px is the limit"
    return best, ""


def _in_time(time_s: np.ndarray, place: np.ndarray, seen: np.ndarray, span: slice) -> GapFill | None:
    """Fit a cubic spline in time through the places (n,) of one marker."""

    def fill(gap: slice, known: np.ndarray) -> np.ndarray:
        before, after = np.flatnonzero(known[: gap.start]), gap.stop + np.flatnonzero(known[gap.stop :])
        near = np.concatenate([before[-NEAR_FRAMES:], after[:NEAR_FRAMES]])
        return CubicSpline(time_s[near], place[near])(time_s[gap])

    return _rehearse(fill, place, seen, span)


def _from_others(
    time_s: np.ndarray, place: np.ndarray, seen: np.ndarray, k: int, span: slice, lag: int
) -> GapFill | None:
    """Predict marker k from the others that are seen throughout the gap, shifted to meet its own samples."""
    around = slice(max(span.start - 1 - lag, 0), span.stop + 1 + lag)
    others = np.flatnonzero(seen[around].all(axis=0) & (np.arange(seen.shape[1]) != k))
    if len(others) < 2:
        return None
    frames = np.arange(len(time_s))
    lagged = [np.clip(frames + shift, 0, frames[-1]) for shift in ((-lag, 0, lag) if lag else (0,))]
    middle = place[:, others].mean(axis=1)
    shape = np.concatenate([(place[:, others] - middle[:, None])[row] for row in lagged], axis=1)  # (n, w)
    whole = np.isfinite(shape).all(axis=1) & np.all([seen[row][:, others].all(axis=1) for row in lagged], axis=0)
    learning = whole & seen[:, k]
    if learning.sum() < FRAMES_PER_WEIGHT * shape.shape[1]:
        return None
    known = shape[learning]
    ridge = len(known) * NOISE_PX**2 * np.eye(shape.shape[1])
    weights = np.linalg.solve(known.conj().T @ known + ridge, known.conj().T @ (place[:, k] - middle)[learning])
    put = middle + np.where(whole[:, None], shape, 0) @ weights  # (n,)
    off = place[:, k] - put

    def fill(gap: slice, known: np.ndarray) -> np.ndarray:
        before = np.flatnonzero(known[: gap.start])[-END_FRAMES:]
        after = gap.stop + np.flatnonzero(known[gap.stop :])[:END_FRAMES]
        ends_s = (time_s[before].mean(), time_s[after].mean())
        share = (time_s[gap] - ends_s[0]) / (ends_s[1] - ends_s[0])
        return put[gap] + off[before].mean() * (1 - share) + off[after].mean() * share

    return _rehearse(fill, place[:, k], learning, span)


def _rehearse(
    fill: Callable[[slice, np.ndarray], np.ndarray], place: np.ndarray, known: np.ndarray, span: slice
) -> GapFill | None:
    """Fill the gap, and measure the error in gaps of the same length; return None if too few can be rehearsed."""
    margin, long = 2 * END_FRAMES, span.stop - span.start
    runs = [(first + margin, last + 2 - margin - long) for first, last in stretches(known)]
    starts = np.array([start for run in runs for start in range(*run)])
    enough = known[: span.start].sum() >= 2 and known[span.stop :].sum() >= 2
    if not enough or len(starts) < REHEARSALS // 3:
        return None
    errors = []
    for start in starts[np.linspace(0, len(starts) - 1, min(len(starts), REHEARSALS)).astype(int)].tolist():
        gap = slice(start, start + long)
        without = known.copy()
        without[gap] = False
        errors.append(fill(gap, without) - place[gap])
    error_px = float(np.sqrt(np.mean(np.abs(errors) ** 2) / 2))
    return GapFill(fill(span, known), error_px)


def _confidence(time_s: np.ndarray, confidence: np.ndarray, span: slice) -> np.ndarray:
    """Return the confidence of filled samples (f,): that of the ends, falling with the distance to them in time."""
    ends = [span.start - 1, span.stop]
    from_ends = np.interp(time_s[span], time_s[ends], confidence[ends])
    away_s = np.minimum(time_s[span] - time_s[ends[0]], time_s[ends[1]] - time_s[span])
    return CONFIDENCE * from_ends * 0.5 ** (away_s / HALVES_S)
