"""Frequency of a beat, with an honest standard error, and the part of a trial in which the tail beats.

`estimate_frequency` does harmonic regression of the tail markers. All share one frequency; each has its own mean, drift
and harmonics. The standard error allows for residuals that are correlated in time and across markers. `beating_part`
finds the longest stretch in which the beat lasts.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
from scipy.special import softmax
from scipy.stats import median_abs_deviation

from fitting.pool import design, weighted_fit
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag

# The frequency
BLOCKS_PER_BEAT = 16.0  # blocks over which residuals are summed
CORRELATIONS = np.append(0.0, 1 - np.geomspace(0.7, 0.005, 24))  # those tried between neighbouring blocks
HARMONICS = 3  # harmonics of the beat that are fitted
SEARCH_HZ = (0.1, 15.0)  # range of the search, as session.toml allows
STILL_M = 1e-3  # a tail that moves by less does not move at all: trackers err by as much
OFF_COMMAND = 0.05  # relative difference to the command that is worth a flag
OTHER_UNITS = {"rad/s": 2 * np.pi, "turns a minute": 60.0}
"""Units in which people note speeds, and how many of them are one turn a second."""
NEAR_A_UNIT = 0.1  # relative difference to a command in such a unit
LEAST_EXPLAINED = 0.5  # share of the tail's motion below which something else than a beat moves it
_PHASES = 16  # phases of a beat
_SHOWN = 0.75  # share of them that must be seen
_TURNS = 3.0  # least number of beats that tell
_REWEIGHTINGS = 3  # rounds in which outliers lose weight
_AT_ONCE = 64  # frequencies that are tried at once
_HUBER = 2.0  # residuals beyond this many robust standard deviations count less

# The beating part
_HOP = 0.25  # part of a beat between windows of one beat
_BEATING = 0.4  # least share of the usual amplitude; a window that is half at rest has about half of it
_USUAL = 80.0  # percentile of the windows that counts as usual
_LEAST_REST = 0.2  # least part of a beat without motion at either end that is a rest
_STILL = 0.12  # share of its usual speed below which the tail does not move; a sine is as slow for 8 % of its beat
_SHORT = 0.08  # part of a beat, to either side, over which a speed is taken
_LEAST_SEEN = 0.5  # share of a window's frames in which a marker has to be seen
FEW_BEATS = 4.0  # fewer may hide a rest, and lasting noise looks like so many
CLEAR = 0.97  # share of its motion that the beat of a swim explains in few beats
# Shares that a clear beat explains at least, by number of beats. The likeliest beat of lasting noise explains up to
# 0.96 of it in 3 to 4 beats, 0.84 in 5 to 6, 0.42 in 8 to 12.
_CLEAR_AT_BEATS = (3.0, 5.0, 8.0)
_CLEAR_SHARES = (CLEAR, 0.92, 0.7)
_LEAST_FOR_WHITE = 0.9  # least share that the beat explains, so that white noise is told from it
JUDGED = 3.0  # least number of beats, so that one can be at rest without being most of them


def standard_error(
    columns: np.ndarray,
    slope: np.ndarray,
    residual: np.ndarray,
    weight: np.ndarray,
    frames_per_beat: float,
) -> float:
    """Return the standard error of a number that k markers share (a frequency, a speed), with all else fitted to each.

    Tracking errors stay for several frames and are shared by the markers. Summing their covariance lag by lag (Newey
    and West 1987) finds too little of it, because the regression of each marker has eaten the residual near its
    harmonics, just where the frequency is sensitive. Restricted likelihood (Patterson and Thompson 1971) allows for
    that. The noise is taken as first-order autoregressive in means over short blocks of frames, in which white noise
    averages out.

    Args:
        columns: (n, c) the regressors of each marker.
        slope: (n, k) d model / d number, such as m/Hz; the number is sum(slope * series) / sum(slope^2).
        residual: (n, k) m.
        weight: (n, k) of each sample in the regression, 0 leaves it out.
        frames_per_beat: frames in a beat.

    Returns:
        In the number's unit; nan where no marker has more blocks than regressors, or none beats.
    """
    block = np.arange(len(residual)) // max(round(frames_per_beat / BLOCKS_PER_BEAT), 1)
    total = _sum_blocks(weight, block)  # (b, k)
    pull = _sum_blocks(weight * slope, block)  # (b, k) of each block's mean residual on the frequency
    groups: dict[bytes, list[tuple[int, np.ndarray]]] = {}
    for k in range(residual.shape[1]):
        used = total[:, k] > 0
        series = np.column_stack([residual[:, k], columns, slope[:, k]])
        mean = _sum_blocks(weight[:, k : k + 1] * series, block)[used] / total[used, k : k + 1]
        if len(mean) > columns.shape[1] + 1:
            groups.setdefault(used.tobytes(), []).append((k, mean))
    curvature = float((weight * slope**2).sum())
    if curvature <= 0 or not groups:
        return float("nan")
    fresh, deviances = np.zeros((len(CORRELATIONS), *pull.shape)), np.zeros(len(CORRELATIONS))
    for seen, members in groups.items():
        blocks, markers = np.flatnonzero(np.frombuffer(seen, bool)), [k for k, _ in members]
        found, own = _innovations(blocks, np.stack([mean for _, mean in members]))
        fresh[:, blocks[:, None], markers] = found
        deviances += own
    spreads = [_spread(pull, each, correlation) for each, correlation in zip(fresh, CORRELATIONS, strict=True)]
    spread = softmax(-deviances / 2) @ spreads  # the correlation is not known either
    return float(np.sqrt(spread)) / curvature


def _innovations(blocks: np.ndarray, means: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the residuals of m markers freed of each correlation, over the root of their freedom, and the deviances.

    Args:
        blocks: (b,) usable blocks, the same of these markers.
        means: (m, b, 1 + c) mean residual and regressors of each marker in each block.

    Returns:
        (r, b, m) residuals and (r,) restricted deviances, for r correlations.
    """
    gaps, freedom = np.diff(blocks), means.shape[1] - means.shape[2] + 1
    carried = np.column_stack([np.zeros(len(CORRELATIONS)), np.power.outer(CORRELATIONS, gaps)])[:, None, :, None]
    scale = np.sqrt(1 - carried**2)  # (r, 1, b, 1); what is carried is from the block before
    white = (means - carried * np.concatenate([means[:, :1], means[:, :-1]], axis=1)) / scale  # (r, m, b, 1 + c)
    basis, triangle = np.linalg.qr(white[..., 1:])
    fresh = white[..., 0] - (basis @ (np.swapaxes(basis, 2, 3) @ white[..., :1]))[..., 0]  # (r, m, b)
    variance = (fresh**2).sum(axis=2) / freedom + 1e-30
    volume = 2 * np.log(np.abs(np.diagonal(triangle, axis1=2, axis2=3)) + 1e-30).sum(axis=2)
    deviance = freedom * np.log(variance) + volume + 2 * np.log(scale).sum(axis=(2, 3))  # (r, m)
    return np.swapaxes(fresh, 1, 2) / np.sqrt(freedom), deviance.sum(axis=1)


def _spread(pull: np.ndarray, fresh: np.ndarray, correlation: float) -> float:
    """Return the variance of the sum of all pulls (b, k), by innovations (b, k) of one correlation."""
    reach = 2 * lfilter([1.0], [1.0, -correlation], pull, axis=0) - pull
    return float(np.einsum("bk,kl,bl->", reach, fresh.T @ fresh, pull))


def _sum_blocks(values: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Sum values (n, k) over the frames of each block, (b, k)."""
    return np.add.reduceat(values, np.flatnonzero(np.diff(block, prepend=-1)), axis=0)


@dataclass(frozen=True)
class SwimFrequency:
    """Beat frequency of a trial.

    Attributes:
        hz: beats a second.
        se_hz: its standard error.
        phase_rad: phase of the first harmonic of the last tail marker that is seen, at time 0 (angle of a cosine).
        amplitude_m: amplitude of that harmonic.
        explained: share of the tail's motion that the harmonics explain, 0 to 1.
        beats: number of beats from the first to the last frame that shows a tail marker.
        commanded_hz: commanded frequency, None when unknown.
        flags: what is doubtful about it.
        swing_m: amplitude of the first harmonic of the tail marker that swings most.
        clear: whether it explains more of the tail's motion, white noise aside, than noise lets the likeliest beat do.
    """

    hz: float
    se_hz: float
    phase_rad: float
    amplitude_m: float
    explained: float
    beats: float
    commanded_hz: float | None
    flags: tuple[Flag, ...] = ()
    swing_m: float = float("nan")
    clear: bool = False


def estimate_frequency(
    time_s: np.ndarray,
    lateral_m: np.ndarray,
    weight: np.ndarray,
    commanded_hz: float | None = None,
) -> SwimFrequency:
    """Estimate the frequency that all tail markers share, between the first and the last frame that show one.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) lateral motion of k tail markers in the head frame, from head to fin, m.
        weight: (n, k) weight of each sample, 0 leaves it out.
        commanded_hz: the command, only compared with.

    Raises:
        NotEnoughData: fewer than 12 usable frames, or less than one beat.
    """
    weight = np.where(np.isfinite(lateral_m), weight, 0.0)
    if (weight.sum(axis=1) > 0).sum() < 12:
        raise NotEnoughData(
            "fewer than 12 frames with a usable tail marker; a frequency needs at least one beat. "
            "Set better start boxes and track it again, or leave the trial out"
        )
    ends = np.flatnonzero(weight.sum(axis=1) > 0)[[0, -1]]
    shown = slice(ends[0], ends[1] + 1)
    time_s, lateral_m, weight = time_s[shown], lateral_m[shown], weight[shown]
    if _range(lateral_m, weight) < STILL_M:
        raise NotEnoughData("the tail does not move: a robot at rest, or a frozen video")
    start = _find_strongest(time_s, lateral_m, weight)
    for _ in range(_REWEIGHTINGS):
        hz = _refine(time_s, lateral_m, weight, start)
        columns = design(time_s, hz, HARMONICS)
        residual = np.nan_to_num(lateral_m) - columns @ weighted_fit(columns, lateral_m, weight)
        weight = weight * _huber(residual, weight)
        start = hz
    coefficients = weighted_fit(columns, lateral_m, weight)
    beats = hz * float(np.ptp(time_s))
    if beats < 1.0:
        raise NotEnoughData(
            f"usable frames of {np.ptp(time_s):.2f} s hold {beats:.2f} beats at {hz:.2f} Hz; at least one is needed"
        )
    seen = weight > 0
    cos, sin = coefficients[2:4, np.flatnonzero(seen.any(axis=0))[-1]]
    values = np.nan_to_num(lateral_m)
    mean = (weight * values).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-12)
    total = float((weight * (values - mean) ** 2).sum())
    explained = max(1.0 - float((weight * residual**2).sum()) / total, 0.0) if total > 0 else 0.0
    clear = _is_clear(explained, total, residual, weight, beats)
    return SwimFrequency(
        hz=hz,
        se_hz=_standard_error(time_s, residual, coefficients, weight, hz),
        phase_rad=float(np.arctan2(-sin, cos)),
        amplitude_m=float(np.hypot(cos, sin)),
        explained=explained,
        beats=beats,
        commanded_hz=commanded_hz,
        flags=(
            *_flags(hz, commanded_hz, beats, explained, clear),
            *_flag_one_side(time_s, np.asarray(seen.any(axis=1)), hz),
        ),
        swing_m=float(np.hypot(coefficients[2], coefficients[3])[seen.any(axis=0)].max()),
        clear=clear,
    )


def _is_clear(explained: float, total: float, residual: np.ndarray, weight: np.ndarray, beats: float) -> bool:
    """Tell whether a beat is clear: it explains most of the weighted square of the motion, m^2, but for white noise."""
    if explained > _LEAST_FOR_WHITE:
        both = np.minimum(weight[1:], weight[:-1])
        steps = (both * np.diff(residual, axis=0) ** 2).sum(axis=0) / np.maximum(both.sum(axis=0), 1e-12)
        explained = explained / (1.0 - float((steps / 2 * weight.sum(axis=0)).sum()) / total)
    return explained >= _least_of_clear(beats)


def _least_of_clear(beats: float) -> float:
    """Return the least share of a tail's motion that a clear beat explains in so many beats."""
    return float(np.interp(beats, _CLEAR_AT_BEATS, _CLEAR_SHARES))


def _flag_one_side(time_s: np.ndarray, seen: np.ndarray, hz: float) -> tuple[Flag, ...]:
    """Flag a beat that may be half as fast, as its frames (n,) show the tail at some phases only."""
    turns = 0.5 * hz * time_s
    if np.ptp(turns) < _TURNS:
        return ()
    shown = len(np.unique(np.floor(turns[seen] % 1.0 * _PHASES))) / _PHASES
    if shown >= _SHOWN:
        return ()
    message = (
        f"the tail is seen at {100 * shown:.0f} % of the phases of a beat of {hz / 2:.3g} Hz: it may beat at that, or "
        f"at {hz:.3g} Hz"
    )
    return (Flag("unidentifiable", message=message),)


def _range(lateral_m: np.ndarray, weight: np.ndarray) -> float:
    """Return how far the marker that moves most moves from side to side, m."""
    highest = np.where(weight > 0, np.nan_to_num(lateral_m), -np.inf).max(axis=0)
    lowest = np.where(weight > 0, np.nan_to_num(lateral_m), np.inf).min(axis=0)
    return float((highest - lowest).max())


def _find_strongest(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray) -> float:
    """Find the start of the search: the best single harmonic (more would also fit at half the frequency)."""
    span = float(np.ptp(time_s))
    low = max(SEARCH_HZ[0], 0.8 / span)
    high = min(SEARCH_HZ[1], 0.4 * (len(time_s) - 1) / span)
    grid = np.arange(low, high, 0.15 / span)
    if not len(grid):
        raise NotEnoughData(
            f"{len(time_s)} frames over {span:.4g} s hold no beat between {SEARCH_HZ[0]:g} and {SEARCH_HZ[1]:g} Hz; "
            "are the time stamps in seconds, and is [camera] fps right?"
        )
    series = np.where(weight > 0, np.nan_to_num(lateral_m), 0.0)
    series = series - (weight * series).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-12)
    trend = (time_s - time_s.mean()) / span
    explained = np.concatenate(
        [_power(part, trend, time_s, series, weight) for part in np.split(grid, range(_AT_ONCE, len(grid), _AT_ONCE))]
    )
    return float(grid[np.argmax(explained)])


def _power(
    grid: np.ndarray, trend: np.ndarray, time_s: np.ndarray, series: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """Return the weighted squares (f,) of series (n, k) that mean, drift and a harmonic of each frequency explain."""
    angle = 2 * np.pi * np.multiply.outer(grid, time_s)  # (f, n)
    even = np.broadcast_to(np.stack([np.ones_like(trend), trend]), (len(grid), 2, len(trend)))
    columns = np.concatenate([even, np.cos(angle)[:, None], np.sin(angle)[:, None]], axis=1)  # (f, 4, n)
    pairs = (columns[:, :, None] * columns[:, None]).reshape(len(grid), 16, -1)
    normal = np.moveaxis(pairs @ weight, -1, 1).reshape(len(grid), -1, 4, 4)  # (f, k, 4, 4)
    moment = np.moveaxis(columns @ (weight * series), -1, 1)  # (f, k, 4)
    ridge = 1e-9 * np.trace(normal, axis1=2, axis2=3)[..., None, None] + 1e-300
    found = np.linalg.solve(normal + ridge * np.eye(4), moment[..., None])[..., 0]
    return np.asarray((found * moment).sum(axis=(1, 2)))


def _refine(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, start: float) -> float:
    reach = min(0.5 / float(np.ptp(time_s)), 0.3 * start)

    def misfit(hz: float) -> float:
        columns = design(time_s, hz, HARMONICS)
        residual = np.nan_to_num(lateral_m) - columns @ weighted_fit(columns, lateral_m, weight)
        return float((weight * residual**2).sum())

    bounds = (start - reach, start + reach)
    return float(minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-7}).x)


def _huber(residual: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return weights (n, k) that reduce the influence of each marker's outliers."""
    used = np.where(weight > 0, residual, np.nan)
    result = np.ones_like(residual)
    for k in range(residual.shape[1]):
        if np.isfinite(used[:, k]).sum() > 8:
            scale = median_abs_deviation(used[:, k], scale="normal", nan_policy="omit") + 1e-9
            result[:, k] = np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(residual[:, k]), 1e-12))
    return result


def _standard_error(
    time_s: np.ndarray, residual: np.ndarray, coefficients: np.ndarray, weight: np.ndarray, hz: float
) -> float:
    columns = design(time_s, hz, HARMONICS)
    slope = _frequency_slope(time_s, hz, coefficients)  # (n, k) d model / d hz
    slope = slope - columns @ weighted_fit(columns, slope, weight)
    frames_per_beat = len(time_s) / max(hz * float(np.ptp(time_s)), 1.0)
    return standard_error(columns, slope, residual, weight, frames_per_beat)


def _frequency_slope(time_s: np.ndarray, hz: float, coefficients: np.ndarray) -> np.ndarray:
    angle = 2 * np.pi * hz * time_s[:, None]
    total = np.zeros((len(time_s), coefficients.shape[1]))
    for k in range(1, HARMONICS + 1):
        cos, sin = coefficients[2 * k], coefficients[2 * k + 1]
        total += k * (sin * np.cos(k * angle) - cos * np.sin(k * angle))
    return 2 * np.pi * time_s[:, None] * total


def _flags(hz: float, commanded_hz: float | None, beats: float, explained: float, clear: bool) -> tuple[Flag, ...]:
    flags = []
    if explained < LEAST_EXPLAINED:
        message = f"a beat of {hz:.3f} Hz explains only {100 * explained:.0f} % of the tail's motion: do not trust it"
        flags.append(Flag("unidentifiable", message=message))
    if commanded_hz and abs(hz / commanded_hz - 1) > OFF_COMMAND:
        off = 100 * (hz / commanded_hz - 1)
        message = f"the tail beats at {hz:.3f} Hz, {off:+.0f} % off the commanded {commanded_hz:g} Hz"
        for unit, of_a_hertz in OTHER_UNITS.items():
            if abs(commanded_hz / (of_a_hertz * hz) - 1) < NEAR_A_UNIT:
                message += f": is commanded_hz in {unit}?"
        flags.append(Flag("frequency_off_command", message=message))
    if beats < 2.0:
        message = f"only {np.floor(10 * beats) / 10:.1f} beats: fewer than two determine a frequency poorly"
        flags.append(Flag("few_beats", message=message))
    elif beats < FEW_BEATS and not clear:
        message = (
            f"a beat of {hz:.3f} Hz explains {100 * explained:.1f} % of the tail's motion in {beats:.1f} beats, white "
            f"noise included; at least {100 * _least_of_clear(beats):.1f} % of the rest are expected: if the robot "
            "rests in part, cut the recording to its swim"
        )
        flags.append(Flag("few_beats", message=message))
    return tuple(flags)


# The part of a trial in which the tail beats.


def beating_part(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, hz: float) -> slice:
    """Return the frames of the longest stretch in which the tail beats throughout.

    Each marker's amplitude in windows of one beat is compared with what it usually is. A window that does not show the
    tail says nothing. At either end even a rest of a fifth of a beat is left out, in which the tail does not move.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) sideways motion of k tail markers in the head frame, m.
        weight: (n, k) of each sample, 0 leaves it out.
        hz: beats a second.

    Returns:
        All frames where the tail beats from the first to the last.
    """
    beats = _beating_windows(time_s, lateral_m, weight, hz)
    still = _is_still(time_s[beats], lateral_m[beats], weight[beats], hz)
    moving = np.flatnonzero(~still)
    if not len(moving):
        return beats
    rests = (moving[0], len(still) - 1 - moving[-1])
    frames = _LEAST_REST / hz / float(np.median(np.diff(time_s)))
    before, after = (rest if rest >= frames else 0 for rest in rests)
    return slice(beats.start + int(before), beats.stop - int(after))


def _is_still(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, hz: float) -> np.ndarray:
    """Tell in which frames (n,) the tail does not move; where none of it is seen, as in the frame before."""
    reach = max(round(_SHORT / hz / float(np.median(np.diff(time_s)))), 1)
    if len(time_s) <= 2 * reach:
        return np.zeros(len(time_s), bool)
    seen = np.where((weight > 0) & np.isfinite(lateral_m), lateral_m, np.nan)
    moved = (seen[2 * reach :] - seen[: -2 * reach]) / (time_s[2 * reach :] - time_s[: -2 * reach])[:, None]
    known = np.isfinite(moved)
    squares = np.where(known, moved**2, 0.0)
    usual = squares.sum(axis=0) / np.maximum(known.sum(axis=0), 1)  # (k,)
    expected = known @ usual
    still = squares.sum(axis=1) < _STILL**2 * expected
    slow = pd.Series(np.where(expected > 0, still, np.nan)).ffill().bfill()
    mostly = slow.rolling(2 * reach + 1, center=True, min_periods=1).mean().to_numpy() > 0.5
    return np.pad(mostly, reach, mode="edge")


def _beating_windows(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, hz: float) -> slice:
    """Return the frames of the longest run of windows in which the tail beats; all in a trial of few beats."""
    whole, period_s = slice(0, len(time_s)), 1 / hz
    if np.ptp(time_s) < JUDGED * period_s:
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
    columns = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    found = np.full(len(weight[0]), np.nan)
    for marker in range(len(found)):
        good = (weight[frames, marker] > 0) & np.isfinite(lateral_m[frames, marker])
        if good.mean() >= _LEAST_SEEN and good.sum() > 3:
            fitted = np.linalg.lstsq(columns[good], lateral_m[frames, marker][good], rcond=None)[0]
            found[marker] = np.hypot(fitted[1], fitted[2])
    return found
