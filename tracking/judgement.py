"""The judgement of a trial that was tracked here, by all there is: states, look, order, shape and motion.

Markers that are lost, drift, have the wrong size or are exchanged do not count, nor what `quality` finds on any tracks.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd
import xarray as xr
from scipy.ndimage import maximum_filter1d, median_filter

from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from swimcal.session_file import FEWEST_MARKERS, HEAD_MARKERS
from swimcal.tracks import markers_of, pixels_of
from tracking.exchanges import exchange_flags, impossible_flags, strayed_flags
from tracking.harmed_frames import stretches
from tracking.quality import check_tracks
from tracking.tracked import drop_repeat_flags, mask_untrusted, repeated_frames, seen_in

SIZE_OFF = 0.3
"""Relative departure of the apparent diameter from its median, against that of all markers in the frame."""
SIZE_FRAMES = 5
"""Over which the median of that departure is taken, so that one blurred frame is not flagged."""
LEAST_CONFIDENCE = 0.35
"""A marker below it …"""
DRIFT_FRAMES = 10
"""… for so many frames on end may have drifted onto something else."""
LONELY_CONFIDENCE = 0.5
"""Confidence below which a marker behind the head counts only beside a neighbour that does."""
FAINT_CONFIDENCE = 0.2
"""A marker below it is not believed in a single frame: a third of such samples are on something else (blind test)."""
MOMENT_FRAMES = 5
"""Largest number of frames that are a mere moment, between as many and more in which a marker does not count."""
LEFT_FRAMES = 3
"""Least number of frames in which half of the markers do not count, for the others to be doubted."""
FAST, FAST_FRAMES = 0.5, 3
"""A marker that moves between two frames by this share of the distance to its nearest neighbour, once in so many
frames, is named by the body's distances alone: no motion can be carried on."""
LONG_GAP, AROUND_GAP, HALFWAY = 6.0, 10, 0.5
"""Names are not sure after a gap in time of so many usual frames in which the markers, at their speed in so many frames
before, move by this share of the distance of the nearest two."""


def trusted(tracked: xr.Dataset, layout: RobotSpec) -> xr.Dataset:
    """Judge a tracked trial by all there is: states, look, order along the body, shape and motion.

    It comes after edits and filled gaps; of the layout only the markers are used. It gets the flags of the tracker, of
    `judge` and of `check_tracks`, each once, and its weights: 0 where a sample does not count, or is not believed.
    """
    own = [flag for flag in (*tracked.flags, *judge(tracked, layout)) if flag.kind != "gap"]
    first = int(np.argmax(seen_in(tracked).any(axis=1)))
    quality = check_tracks(mask_untrusted(tracked.assign_attrs(flags=tuple(own))).isel(time=slice(first, None)), layout)
    weight = np.zeros(tracked.state.shape)
    weight[first:] = quality.weight
    lonely = _lonely(tracked, weight, layout)
    weight[lonely] = 0.0
    alone = [
        Flag("drift", (name,), span, f"{name} looks little like itself, and no neighbour is seen that tells its place")
        for k, name in enumerate(markers_of(tracked))
        for span in stretches(lonely[:, k])
    ]
    flags = (*own, *drop_repeat_flags(tracked, (flag.later(first) for flag in quality.flags)), *alone)
    found = tracked.assign(weight=(("time", "keypoint"), weight))
    return found.assign_attrs(flags=tuple(dict.fromkeys(flags)))


def judge(tracked: xr.Dataset, layout: RobotSpec) -> tuple[Flag, ...]:
    """Flag a tracked trial, by first frame: ``lost_marker``, ``drift``, ``size``, ``swap`` and ``few_frames``.

    Merged, frozen and jumping markers are found on any tracks, tracked here or elsewhere: `check_tracks`.
    """
    seen = seen_in(tracked)
    low_confidence = seen & (tracked.confidence.values < LEAST_CONFIDENCE)
    size = pd.DataFrame(tracked["size"].values)
    relative = size / size.median()
    several = relative.count(axis=1) > 2
    common = relative.median(axis=1).where(several, 1.0)  # all do so together where the camera or the water moves
    off = (relative.div(common, axis=0) - 1).abs().fillna(0.0)
    faint = seen & (tracked.confidence.values < FAINT_CONFIDENCE)
    suspicions = (
        ("lost_marker", ~seen & ~repeated_frames(tracked)[:, None], 1, "is not seen"),
        ("drift", low_confidence, DRIFT_FRAMES, "has lost its appearance; the tracker may have drifted"),
        ("drift", faint, 1, "hardly looks like itself"),
        ("size", median_filter(off, size=(SIZE_FRAMES, 1)) > SIZE_OFF, 1, "appears in another size"),
    )
    flags = [
        Flag(kind, (marker,), span, f"{marker} {message}")
        for kind, where, least, message in suspicions
        for k, marker in enumerate(markers_of(tracked))
        for span in stretches(where[:, k], least)
    ]
    exchanged = exchange_flags(tracked, layout)
    flags += [*exchanged, *impossible_flags(tracked, layout), *strayed_flags(tracked, layout, exchanged)]
    believed = mask_untrusted(tracked.assign_attrs(flags=(*tracked.flags, *flags)))
    flags += [*_flag_moments(believed), *_flag_leftovers(believed), *_few_frames(believed), *_lost_over_gap(tracked)]
    return tuple(sorted(flags, key=lambda flag: flag.frames or (-1, -1)))


def _flag_moments(believed: xr.Dataset) -> list[Flag]:
    """Flag a marker that counts for a few frames, amid as many and more in which it does not: it is not back."""
    counts = believed.confidence.values > 0
    flags = []
    for k, marker in enumerate(markers_of(believed)):
        gaps = stretches(~counts[:, k], MOMENT_FRAMES)
        for (_, before), (after, _) in pairwise(gaps):
            if after - before - 1 <= MOMENT_FRAMES:
                message = f"{marker} looks like itself for a moment, amid frames in which it does not count"
                flags.append(Flag("drift", (marker,), (before + 1, after - 1), message))
    return flags


def _flag_leftovers(believed: xr.Dataset) -> list[Flag]:
    """Flag the markers that still count while half of all or more do not: nothing tells whose dots they are on."""
    counts = believed.confidence.values > 0
    seen = counts.sum(axis=1)
    names = np.array(markers_of(believed), dtype=object)
    flags = []
    for first, last in stretches((seen > 0) & (2 * seen <= counts.shape[1]), LEFT_FRAMES):
        left = tuple(names[counts[first : last + 1].any(axis=0)].tolist())
        who = f"{', '.join(left[:-1])} and {left[-1]} are" if len(left) > 1 else f"{left[0]} is"
        message = f"only {who} seen: half of the markers or more are not, and nothing tells whose dots these are"
        flags.append(Flag("drift", left, (first, last), message))
    return flags


def _lonely(tracked: xr.Dataset, weight: np.ndarray, layout: RobotSpec) -> np.ndarray:
    """Tell (n, m) which samples behind the head are little like their marker where no neighbour tells its place.

    Args:
        tracked: the tracked trial.
        weight: (n, m) weights of its samples; a neighbour without weight tells nothing.
        layout: the robot.
    """
    names, found = markers_of(tracked), np.zeros(weight.shape, bool)
    order = np.argsort(layout.marker_positions_m(names)[:, 0], kind="stable").tolist()
    for rank, marker in enumerate(order):
        if names[marker] not in HEAD_MARKERS and len(order) >= FEWEST_MARKERS:
            first = min(max(rank - 1, 0), len(order) - 3)
            beside = [k for k in order[first : first + 3] if k != marker]
            found[:, marker] = ~(weight[:, beside] > 0).any(axis=1)
    return found & (weight > 0) & (tracked.confidence.values < LONELY_CONFIDENCE)


def _lost_over_gap(tracked: xr.Dataset) -> list[Flag]:
    """Flag all frames after the first gap in time in which the robot moves so far that markers may be mistaken."""
    position, time_s = np.where(seen_in(tracked)[..., None], pixels_of(tracked), np.nan), tracked.time.values
    step_s, step_px = np.diff(time_s), np.linalg.norm(np.diff(position, axis=0), axis=2)  # (n - 1,), (n - 1, m)
    usual_s = float(np.median(step_s)) if len(step_s) else 0.0
    for before in np.flatnonzero(step_s > LONG_GAP * usual_s).tolist():
        recent = slice(max(before - AROUND_GAP, 0), before)
        speed_px_s = (step_px[recent] / step_s[recent, None]).ravel()
        apart = np.linalg.norm(position[before][:, None] - position[before][None], axis=2)
        apart[np.diag_indices(len(apart))] = np.nan
        if not (np.isfinite(speed_px_s).any() and np.isfinite(apart).any()):
            continue
        moves_px, nearest_px = float(np.nanmedian(speed_px_s) * step_s[before]), float(np.nanmin(apart))
        if moves_px > HALFWAY * nearest_px:
            message = (
                f"{step_s[before]:.2g} s are missing after frame {before}, in which the robot moves by some "
                f"{moves_px:.0f} px; its markers are {nearest_px:.0f} px apart at least: names are not sure from there "
                "on. Cut the film there and track its parts as trials of their own"
            )
            return [Flag("damaged_video", (), (before + 1, len(time_s) - 1), message)]
    return []


def _few_frames(believed: xr.Dataset) -> list[Flag]:
    """Flag each stretch in which markers move too far between frames for their motion to be carried on.

    Samples of confidence 0 do not count: a name on another's dot moves as far as it likes.
    """
    position = np.where(believed.confidence.values[..., None] > 0, pixels_of(believed), np.nan)
    apart = np.linalg.norm(position[:, :, None] - position[:, None], axis=3)  # (n, m, m)
    apart[:, np.arange(apart.shape[1]), np.arange(apart.shape[1])] = np.inf
    nearest = np.nan_to_num(apart, nan=np.inf).min(axis=2)[1:]
    share = np.nan_to_num(np.linalg.norm(np.diff(position, axis=0), axis=2) / nearest)  # (n - 1, m)
    fast = maximum_filter1d(np.concatenate([[0.0], share.max(axis=1)]), FAST_FRAMES) > FAST
    flags = []
    for first, last in stretches(fast, 2 * FAST_FRAMES):
        inside = share[max(first - 1, 0) : last]
        names = tuple(np.array(markers_of(believed), dtype=object)[(inside > FAST).any(axis=0)].tolist())
        several = len(names) > 1
        who = f"{', '.join(names[:-1])} and {names[-1]} move" if several else f"{names[0]} moves"
        message = (
            f"{who} by up to {inside.max():.0%} of the distance to the nearest neighbour from one frame to the next: "
            "too few frames a beat to carry motion on; names rest on the distances along the body. Film with more "
            "frames a second"
        )
        flags.append(Flag("few_frames", names, (first, last), message))
    return flags
