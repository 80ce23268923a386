"""Frames that smooth motion gives away: jumps of the whole body, frames that halt it, or in exchanged order.

Jumps come of a bumped camera, spliced clips, frames that are gone without a trace in the time stamps.
No single marker gives them away, since all of them jump together and keep the body's shape. Smooth motion does: the
step between two frames is about the mean of the steps before and after it (the difference is of third order in time). A
few missing frames change less than that; they show where the motion is smooth again once their time is put between.
"""

from __future__ import annotations

import warnings
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import maximum_filter1d

from swimcal.flags import Flag
from swimcal.session_file import HEAD_MARKERS
from tracking.harmed_frames import FROZEN_MOTION_PX, stretches

LEAST_PX = 6.0
"""A jump moves half of the markers or more off the smooth motion by at least so many px."""
LEAST_LENGTH = 0.01
"""It moves them by at least this share of the body's length in the picture."""
TIMES_USUAL = 4.0
"""It moves them by at least so many times what is usual in the trial, noise and hard beats included."""
AROUND, STANDS_OUT = 10, 2.0
"""No step of so many frames before and after is half as large, or the robot was shaken."""
UNSEEN_FRAMES, MOST_UNSEEN = 3, 30
"""A head that was not seen for so many frames, and at most for so many, can be told from its speed."""
FAR_UNSEEN = 0.08
"""Share of the body's length by which it is not where it can have swum to; it sways by half as much."""
HALTS, HALTS_FRAMES = 0.12, 4
"""Share of the steps before and after that no marker moves by in a picture that is coded anew and halts the motion, for
at most so many frames."""
GOES_ON_AS = 0.7
"""Least cosine between these steps: nothing that turns back halts."""
ORDERLY = 0.05
"""Share of the squares off a smooth course that exchanged frames leave in their right order, …"""
OUT_OF_ORDER, OUT_OF_ORDER_PX = 4.0, 1.0
"""… where there are so many times as many as in frames in order, and some marker moves so far between the two."""
IN_ORDER = 0.1
"""Quantile of these squares that frames in order have, however many are not: two of them disturb nine windows."""
ORDER_AROUND, ORDER_DEGREE = 3, 3
"""Frames before and after the two, and the degree of the course through all eight."""
LONG_STEP = 2.5
"""A time step this many times the usual one is a gap that the stamps tell of."""
FEWEST_MARKERS = 3
EVEN = 0.25
"""Time steps that differ from the usual one by less than this share of it are even."""
MOVING_PX, FEWEST_MOVING = 6.0, 2
"""Frames that are missing show in markers whose places range over so much, if so many do."""
ON_BOTH_SIDES = 0.2
"""They move on both sides of the gap, on one by this share of the other at least: a start from rest is no gap."""
MOST_MISSING = 12
"""Frames that are looked for between two; more are a jump."""
BESIDE, DEGREE = 5, 4
"""Frames on either side through which smooth motion is laid, and the degree of its polynomial in time."""
BETTER = 0.5
"""Frames are missing where the motion with their time put between is off by this share, at most, of what it is off
without."""
STANDS_OUT_MISSING = 2.5
"""Without it, it is off by at least so many times what is usual in the trial."""
LEAST_OFF_PX = 0.3
"""Without it, it is off by at least so many px, rms."""
LONGER = (1.5, 3.5)
"""Range of the length of a long step, over one or two missing frames, against the mean of the steps beside it."""
NOT_LONGER = 1.25
"""Limit of the same for the steps beside a long one: where all are longer, a beat has few frames. A long step exceeds
it also in the markers' motion against one another, or the camera was shaken."""
ALIKE = 0.5
"""Largest distance of a long step from a multiple of its neighbours' mean, against that from the mean itself."""
LEAST_LONGER_PX = 1.0
"""Least px, rms over the markers, by which a long step exceeds the mean of its neighbours."""
SAME = 0.5
"""Largest difference of the steps beside a long one, against their sum: a picture that came late makes more."""
SHORTER, TIMES_SHORTER = 0.4, 4
"""Noise makes steps this short about as often as long ones; missing frames make so many times more long ones."""
STANDS_OUT_STEP = 3.0
"""Least distance of a long step from its neighbours' mean, against the usual one, where long steps are few."""
FEWEST_GAPS, GAPS_SHARE = 3, 0.01
"""Least number, and share of the frames, of places with missing frames beyond which others are missing unseen."""


def find_jumps(time_s: np.ndarray, position_px: np.ndarray, names: tuple[str, ...]) -> list[tuple[int, float]]:
    """Find the frames to which the whole body jumps, in sight or unseen; frames without samples tell nothing.

    Args:
        time_s: (n,) times of the frames, s.
        position_px: (n, m, 2) positions of the markers in the image, px, nan where missing.
        names: names of the m markers.

    Returns:
        Each frame with its distance from the motion, px; 0 where frames are missing.
    """
    told = np.flatnonzero(np.isfinite(position_px).any(axis=(1, 2)))
    found = {int(told[frame]): off_px for frame, off_px in body_jumps(time_s[told], position_px[told])}
    head = [names.index(name) for name in HEAD_MARKERS if name in names]
    if len(head) == len(HEAD_MARKERS):
        found |= dict(_unseen_jumps(time_s, position_px, head))
    return sorted(found.items())


def body_jumps(time_s: np.ndarray, position_px: np.ndarray) -> list[tuple[int, float]]:
    """Find the frames to which the whole body jumps, with its distance from its motion, px; 0 where frames are missing.

    Args:
        time_s: (n,) times of the frames, s.
        position_px: (n, m, 2) positions of the markers in the image, px, nan where missing.
    """
    if len(time_s) < 8 or position_px.shape[1] < FEWEST_MARKERS:
        return []
    off = _off_motion_px(time_s, position_px)  # (n,)
    known = off[np.isfinite(off)]
    if not len(known):
        return []
    whole = position_px[np.isfinite(position_px).all(axis=(1, 2))]
    body_px = float(np.median(np.hypot(*np.ptp(whole, axis=1).T))) if len(whole) else 0.0
    least = max(LEAST_PX, LEAST_LENGTH * body_px, TIMES_USUAL * float(np.quantile(known, 0.9)))
    far = np.nan_to_num(off) > least
    peaks = [k for k in np.flatnonzero(far).tolist() if off[k] >= np.nanmax(off[max(k - 2, 0) : k + 3])]
    jumps = {k: float(off[k]) for k in peaks if off[k] > STANDS_OUT * _largest_around_px(position_px, k)}
    moving = position_px[:, _moving(position_px)]
    missing = _follows_missing(time_s, moving)
    missing |= _follows_long_step(time_s, moving) & ~maximum_filter1d(missing, 3)
    return sorted((dict.fromkeys(np.flatnonzero(missing).tolist(), 0.0) | jumps).items())


def _unseen_jumps(time_s: np.ndarray, position_px: np.ndarray, head: list[int]) -> list[tuple[int, float]]:
    """Find the frames in which the head is seen again where it cannot have swum to, with its distance, px.

    Over a cut a tracker may lose the robot for a moment, or all of it but the head. Its speed before and after tells
    how far it swims.

    Args:
        time_s: (n,) times of the frames, s.
        position_px: (n, m, 2) positions of the markers in the image, px, nan where missing.
        head: numbers of nose and neck.
    """
    told = np.isfinite(position_px).all(axis=2)  # (n, m)
    middle, count = position_px[:, head].mean(axis=1), told.sum(axis=1)
    seen, whole = np.flatnonzero(told[:, head].all(axis=1)), position_px[told.all(axis=1)]
    if not len(whole) or len(seen) <= 2 * AROUND:
        return []
    body_px = float(np.median(np.linalg.norm(np.ptp(whole, axis=1), axis=1)))
    usual_s = float(np.median(np.diff(time_s)))
    gaps, half = np.diff(seen), told.shape[1] / 2
    vanish = (count[seen[:-1]] > half) & (count[seen[:-1] + 1] < half)  # who leaves the picture does so bit by bit
    found = []
    for number in np.flatnonzero(vanish & ((gaps == 1) | (gaps > UNSEEN_FRAMES))).tolist():
        before, after = seen[max(number - AROUND, 0) : number + 1], seen[number + 1 : number + 2 + AROUND]
        last, first = int(before[-1]), int(after[0])
        away_s = time_s[first] - time_s[last]
        if min(len(before), len(after)) <= AROUND or away_s > MOST_UNSEEN * usual_s:
            continue
        speeds = [(middle[k[-1]] - middle[k[0]]) / (time_s[k[-1]] - time_s[k[0]]) for k in (before, after)]
        swum_px = np.mean(speeds, axis=0) * away_s
        off_px = float(np.linalg.norm(middle[first] - middle[last] - swum_px))
        if off_px > max(LEAST_PX, FAR_UNSEEN * body_px + 0.5 * float(np.linalg.norm(swum_px))):
            found.append((first, off_px))
    return found


def longest_part(frames: int, jumps: list[int]) -> slice:
    """Return the longest part between jumps: what is compared of a trial goes on without a break."""
    edges = [0, *jumps, frames]
    first, last = max(pairwise(edges), key=lambda part: part[1] - part[0])
    return slice(first, last)


def jump_flags(jumps: list[tuple[int, float]], part: slice, markers: tuple[str, ...]) -> list[Flag]:
    """Make a flag for each jump of the whole body.

    Args:
        jumps: frames and distances, px, as `body_jumps` finds them.
        part: the frames that count.
        markers: names of all markers.
    """

    def message(frame: int, off_px: float) -> str:
        where, count = f"between frames {frame - 1} and {frame}", f"only frames {part.start} to {part.stop - 1} count"
        if not off_px:
            return f"frames are missing {where}, though the times go on; {count}"
        return f"the whole body jumps by {off_px:.0f} px {where}: the camera was moved, or frames are missing; {count}"

    return [Flag("jump", markers, (frame, frame), message(frame, off_px)) for frame, off_px in jumps]


def flag_scattered_gaps(jumps: list[tuple[int, float]], frames: int, names: tuple[str, ...]) -> list[Flag]:
    """Flag all frames where single ones are missing in so many places that others are missing unseen.

    Args:
        jumps: frames and distances, px, as `body_jumps` finds them.
        frames: number of frames of the trial.
        names: names of all markers.
    """
    places = [frame for frame, off_px in jumps if not off_px]
    if len(places) < FEWEST_GAPS or len(places) < GAPS_SHARE * frames:
        return []
    message = (
        f"frames are missing in {len(places)} places or more, the first before frame {places[0]}, though the times go "
        f"on evenly: all of it is at least {len(places) / frames:.0%} too fast, and nothing counts; take the file with "
        "the camera's own times"
    )
    return [Flag("jump", names, (0, frames - 1), message)]


def _moving(position_px: np.ndarray) -> np.ndarray:
    """Return (m,) bool, the markers that move in the trial, if there are some: of a clamped robot the tail."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a marker that is never seen
        low_px, high_px = np.nanquantile(position_px, (0.05, 0.95), axis=0)
    moving = np.nan_to_num((high_px - low_px).max(axis=1)) > MOVING_PX
    return moving if moving.sum() >= FEWEST_MOVING else np.ones(len(moving), bool)


def _follows_missing(time_s: np.ndarray, position_px: np.ndarray) -> np.ndarray:
    """Return (n,) bool, True before a frame where the motion is smooth only with the time of missing frames between."""
    found, count = np.zeros(len(time_s), bool), len(time_s) - 2 * BESIDE + 1
    if count < 1:
        return found
    parts = sliding_window_view(position_px, 2 * BESIDE, axis=0)  # (k, m, 2, 10)
    seen = np.isfinite(parts).all(axis=(2, 3))
    step_s = np.diff(time_s)
    even = np.abs(step_s / np.median(step_s) - 1) < EVEN
    good = sliding_window_view(even, 2 * BESIDE - 1).all(axis=1)
    before, after = (np.isfinite(half).all(axis=(2, 3)) for half in (parts[..., :BESIDE], parts[..., BESIDE:]))
    lost = before & ~after  # over so long a gap a tracker may lose the fastest
    told, most = seen.sum(axis=1), max(FEWEST_MOVING, (position_px.shape[1] + 1) // 2)
    good &= (told >= most) | ((told > 0) & (seen | lost).all(axis=1) & (told + lost.sum(axis=1) >= most))
    paths = np.linalg.norm(np.diff(parts, axis=3), axis=2)  # (k, m, 9)
    ways = np.nan_to_num(np.stack([paths[..., : BESIDE - 1], paths[..., BESIDE:]]).sum(axis=3))  # (2, k, m)
    good &= ways.min(axis=0).sum(axis=1) > ON_BOTH_SIDES * ways.max(axis=0).sum(axis=1)  # nothing starts or stops here
    if not good.any():
        return found
    moment = np.arange(2 * BESIDE) - BESIDE
    off = np.full((MOST_MISSING + 1, count), np.nan)  # px, of the median marker
    for missing in range(MOST_MISSING + 1):
        basis = np.linalg.qr(np.vander((moment + missing * (moment >= 0)).astype(float), DEGREE + 1))[0]
        left = parts[good] - (parts[good] @ basis) @ basis.T
        off[missing, good] = np.nanmedian(np.sqrt((left**2).sum(axis=(2, 3))), axis=1)
    usual = float(np.median(off[:, good].min(axis=0)))
    least = max(LEAST_OFF_PX, STANDS_OUT_MISSING * usual)
    off = np.nan_to_num(off)
    gained = off[0] - off[1:].min(axis=0)
    worse = good & (off[0] > least) & (off[1:].min(axis=0) < BETTER * off[0])
    around = np.pad(gained, BESIDE)
    worse &= gained >= sliding_window_view(around, 2 * BESIDE + 1).max(axis=1)
    found[BESIDE : BESIDE + count] = worse
    return found


def _follows_long_step(time_s: np.ndarray, position_px: np.ndarray) -> np.ndarray:
    """Return (n,) bool, True after a step of all markers that is about twice as long as those before and after it.

    It sees single missing frames that lie close to others; smooth motion over more frames sees more missing ones.
    """
    found, step_s, step_px = np.zeros(len(time_s), bool), np.diff(time_s), np.diff(position_px, axis=0)
    if len(step_px) < 3:
        return found
    even = np.abs(step_s / np.median(step_s) - 1) < EVEN
    seen = np.asarray(np.isfinite(step_px).all(axis=2))
    seen = seen[:-2] & seen[1:-1] & seen[2:]  # (n - 3, m)
    step_px = np.stack([step_px[:-2], step_px[1:-1], step_px[2:]])
    before, middle, after = np.where(seen[..., None], step_px, 0.0)
    usual, count = 0.5 * (before + after), seen.sum(axis=1)
    good = even[:-2] & even[1:-1] & even[2:] & (count >= FEWEST_MOVING) & (2 * count >= position_px.shape[1])
    if not good.any():
        return found

    def length(steps_px: np.ndarray) -> np.ndarray:
        return np.asarray(np.sqrt((steps_px**2).sum(axis=(1, 2))))

    def longer_by(steps_px: np.ndarray, usual_px: np.ndarray) -> np.ndarray:
        return np.asarray((steps_px * usual_px).sum(axis=(1, 2)) / np.maximum(length(usual_px) ** 2, 1e-9))

    def against_body(steps_px: np.ndarray) -> np.ndarray:
        body_px = steps_px.sum(axis=1) / np.maximum(count, 1)[:, None]  # (n - 3, 2)
        return np.where(seen[..., None], steps_px - body_px[:, None], 0.0)

    times = longer_by(middle, usual)
    bend = max(float(np.quantile(times[good], 0.25)), 1.0)  # where a beat has few frames, every step is longer
    off, off_along = length(middle - bend * usual), length(middle - times[:, None, None] * usual)
    usual_off = float(np.quantile(off[good], 0.3))
    good &= (off_along < ALIKE * off) & (off > LEAST_LONGER_PX * np.sqrt(count))
    good &= length(after - before) < SAME * length(after + before)
    near = np.pad(times, 1)
    longer = good & (times > LONGER[0] * bend) & (times < LONGER[1] * bend)
    longer &= np.maximum(near[:-2], near[2:]) < NOT_LONGER
    longer &= longer_by(against_body(middle), against_body(usual)) > NOT_LONGER  # a shaken camera bends no body
    shorter = good & (times < SHORTER * bend)
    if longer.sum() < max(FEWEST_GAPS, TIMES_SHORTER * shorter.sum()):  # a few: by noise, unless they stand out
        longer &= off > STANDS_OUT_STEP * usual_off
    beside = np.pad(longer, 1)
    found[2:-1] = longer & ~beside[:-2] & ~beside[2:]  # two in a row are a shaken camera
    return found


def _largest_around_px(position_px: np.ndarray, frame: int) -> float:
    """Return the largest step of the median marker near a frame, without the step to that frame, px."""
    first = max(frame - 1 - AROUND, 0)
    near = np.linalg.norm(np.diff(position_px[first : frame + AROUND + 1], axis=0), axis=2)  # (k, m)
    seen = np.isfinite(near).any(axis=1)
    seen[frame - 1 - first] = False
    return float(np.nanmedian(near[seen], axis=1).max(initial=0.0))


def _off_motion_px(time_s: np.ndarray, position_px: np.ndarray) -> np.ndarray:
    """Return how far (n,) each step is off the mean of those around it, of the median marker; nan where unknown."""
    step_s = np.diff(time_s)
    velocity = np.diff(position_px, axis=0) / step_s[:, None, None]  # (n - 1, m, 2)
    around = 0.5 * (velocity[:-2] + velocity[2:])
    apart = np.linalg.norm(velocity[1:-1] - around, axis=2) * step_s[1:-1, None]  # (n - 3, m)
    seen = np.isfinite(apart)
    enough = seen.sum(axis=1) >= max(FEWEST_MARKERS, (position_px.shape[1] + 1) // 2)
    usual_s = float(np.median(step_s))
    steady = (np.stack([step_s[:-2], step_s[1:-1], step_s[2:]]) < LONG_STEP * usual_s).all(axis=0)
    off = np.full(len(time_s), np.nan)
    good = enough & steady
    off[2:-1][good] = np.nanmedian(apart[good], axis=1)
    return off


# Frames that halt the motion, or in exchanged order.


def halted_rows(position_px: np.ndarray) -> np.ndarray:
    """Return (n,) frames in which markers (n, m, 2) in full motion stand still, and then go on as they went.

    No body does that. A picture that is coded anew is not quite the one that it repeats, so its markers are not either.
    """
    steps = np.diff(position_px, axis=0)
    length_px = np.linalg.norm(steps, axis=2)  # (n - 1, m)
    largest_px = np.nan_to_num(length_px).max(axis=1, initial=0.0)
    halted = np.zeros(len(position_px), bool)
    for first, last in stretches(largest_px < HALTS * largest_px.max(initial=0.0)):  # steps, to the frames after
        before, after = steps[first - 1 : first], steps[last + 1 : last + 2]
        if last - first >= HALTS_FRAMES or not len(before) == len(after) == 1:
            continue
        known = np.isfinite(np.concatenate([before, steps[first : last + 1], after])).all(axis=(0, 2))
        if known.sum() < 2:
            continue
        came, goes = before[0, known], after[0, known]
        usual_px = min(np.linalg.norm(came, axis=1).max(), np.linalg.norm(goes, axis=1).max())
        still = length_px[first : last + 1, known].max() < HALTS * usual_px and usual_px >= FROZEN_MOTION_PX
        along = float((came * goes).sum())
        halted[first + 1 : last + 2] = still and along > GOES_ON_AS * np.linalg.norm(came) * np.linalg.norm(goes)
    return halted


def exchanged_frames(position_px: np.ndarray) -> np.ndarray:
    """Return (n,) frames that are shown in exchanged order, two and two, by their markers (n, m, 2).

    Those that are found are put right, as they hide others beside them.
    """
    places_px, found = position_px.copy(), np.zeros(len(position_px), bool)
    going = len(position_px) > 2 * ORDER_AROUND + 2
    while going:
        going = False
        for first in _out_of_order(places_px).tolist():
            if not found[first : first + 2].any():
                places_px[[first, first + 1]] = places_px[[first + 1, first]]
                found[first : first + 2] = going = True
    return found


def _out_of_order(position_px: np.ndarray) -> np.ndarray:
    """Return the first of each two frames of (n, m, 2) whose exchange makes the course through them smooth."""
    width = 2 * ORDER_AROUND + 2
    course, _ = np.linalg.qr(np.vander(np.arange(width) - (width - 1) / 2, ORDER_DEGREE + 1))
    order = np.arange(width)
    order[[ORDER_AROUND, ORDER_AROUND + 1]] = ORDER_AROUND + 1, ORDER_AROUND
    windows = sliding_window_view(position_px.reshape(len(position_px), -1), width, axis=0)  # (w, 2 m, width)
    known = np.isfinite(windows).all(axis=2)
    places = np.where(known[..., None], windows, 0.0)
    as_shown, exchanged = (
        (each**2).sum(axis=2) - ((each @ course) ** 2).sum(axis=2) for each in (places, places[..., order])
    )  # (w, 2 m) squares off the course
    count = np.maximum(known.sum(axis=1), 1)
    off, off_exchanged = as_shown.sum(axis=1), exchanged.sum(axis=1)
    apart_px = np.abs(places[..., ORDER_AROUND + 1] - places[..., ORDER_AROUND]).max(axis=1)
    wrong = (off_exchanged < ORDERLY * off) & (apart_px > OUT_OF_ORDER_PX) & (known.sum(axis=1) >= 2 * FEWEST_MARKERS)
    wrong &= off / count > OUT_OF_ORDER * np.quantile(off / count, IN_ORDER)
    return np.flatnonzero(wrong) + ORDER_AROUND


def exchange_of_frames_flags(exchanged: np.ndarray) -> list[Flag]:
    """Make a flag for each two frames, of (n,), that are shown in exchanged order."""
    return [
        Flag("exchanged_frames", frames=span, message=f"frames {span[0]} to {span[1]} are shown in exchanged order")
        for span in stretches(exchanged)
    ]
