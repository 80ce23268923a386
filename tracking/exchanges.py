"""Names that were exchanged: which markers carry the name of another, and from which frame on.

`exchange_flags` finds markers of the middle line, and left and right markers, that carry one another's names.
`impossible_flags` finds markers in an order, or at distances, that no bend of the body makes. `exchanged_apart` judges
tracks from elsewhere: it also finds any names that change places from one frame to the next.
"""

from collections.abc import Iterable
from itertools import combinations, pairwise

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment

from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from swimcal.session_file import HEAD_MARKERS
from swimcal.tracks import markers_of, pixels_of
from tracking.body_model import rows_alike
from tracking.following import widened
from tracking.harmed_frames import stretches
from tracking.tracked import seen_in

EXCHANGE = 0.5
"""Two markers are taken for exchanged when exchanging them shortens the line through the markers by this share of their
own distance."""
EXCHANGE_FRAMES = 2
"""The shortest exchange that is flagged."""
APART, LEAST_FRAMES = 0.5, 3
"""In tracks from elsewhere two markers count as exchanged while further apart than this share of what is usual, for so
many frames: what is nearer is merged."""
MIDDLE_M = 1e-6
"""Farthest distance of a marker from the middle line that counts as on it."""
RENAMED = 0.25
"""Names changed places where others make the markers move by this share, at most, of what they moved as named."""
BEND_DEG = 50.0
"""Largest bend of a body at a marker."""
FOLD_DEG = 110.0
"""Largest angle between two steps along a body, whatever is missing between them."""
SHORTEST_FIN = 0.65
"""Least ratio of the step to the last marker to its length in the start boxes, as a soft fin bends (public trials)."""
STEP_SD = 0.07
"""Relative standard deviation of the length of a step along the body."""
PLACED_PX = 3.5
"""Standard deviation of the length of a step between two boxes that were placed by hand, px."""
MOST_DEPARTURE = 16.0
"""Largest sum of squared departures of steps, in standard deviations: 13 in the believed frames of public trials."""
LIKELIER_NAMES = 8.0
"""Least reduction of this sum by other names, from which the dots are taken to carry these; some markers are lost."""
SURE_NAMES = 4.0
"""Least increase of this sum by other names, from which the names of all markers but one are taken to be right."""
MOST_ADDED = 4.0
"""Largest part of this sum that a marker found again may add: 0 to 2 where it is at its dot, 6 to 9 on a glint."""
ONE_STEP = 0.3
"""Largest difference of a step from its length, in its logarithm, up to which two markers are one step apart.

Names that are shifted have the steps of others, which differ by less.
"""
LOST_FRAMES = 12
"""A marker that was lost for so many frames has its own name only where the names in the frame are sure."""
HEAD_LOST_FRAMES = 3
"""Number of lost frames after which nose or neck has its own name only where both are seen, or the names are sure."""
CLEARLY = 0.5
"""Least confidence of a nose or neck that is clearly seen."""
RECENT_FRAMES = 30
"""Number of frames before a marker of the head is lost that tell its place on the head."""
STRAYED = 0.5
"""Share of the way to the nearest other marker by which a marker of the head is off its place."""
TIMES_USUAL = 4.0
"""Where it was never lost it is off, for two frames at least, by so many times what its place usually changes by.

The usual change is that over `BACK_FRAMES`.
"""
NEAREST_CAMERA_M = 1.0
"""Least height of a camera over nose and neck, for the parallax of a marker that is higher than these."""
BACK_FRAMES = 6
"""Number of frames for which it is back before it is believed."""
JOINED = 3
"""Largest number of frames between two flagged stretches of a marker that are flagged, too."""


def exchange_flags(tracked: xr.Dataset, layout: RobotSpec) -> list[Flag]:
    """Flag pairs of markers on the mid line that carry each other's name, and of left and right markers.

    The markers of the mid line are in one order along the body, however it bends: exchanging two of them back makes
    the line through all of them shorter. Of several such pairs that counts which shortens it most; the others are
    judged once it is exchanged back. A left marker is to the left of the line through the first two of them.
    """
    names = markers_of(tracked)
    place = layout.marker_positions_m(names)  # (m, 3)
    middle = _mid_line(place)
    pairs = _exchanged(np.array(pixels_of(tracked)), middle)
    if len(middle) > 1:
        pairs += [(pair, _mirrored(pixels_of(tracked), middle, *pair)) for pair in _sides(place)]
    return [
        Flag("swap", (names[a], names[b]), span, f"{names[a]} and {names[b]} seem to be exchanged")
        for (a, b), wrong in pairs
        for span in stretches(wrong, EXCHANGE_FRAMES)
    ]


def impossible_flags(tracked: xr.Dataset, layout: RobotSpec) -> list[Flag]:
    """Flag markers on the mid line in an order, or at distances, that no bend of the body makes.

    The distances are those of the first frame in which all are seen, at the scale of nose and neck. Where leaving
    out one mends it, and the others surely have their own names, that one is flagged; else all behind the head are.
    A marker that is followed on from there, or found again after a while, is flagged until the names are sure. Further
    markers of the head are not judged: the tail swings past them.
    """
    names = markers_of(tracked)
    line = _mid_line(layout.marker_positions_m(names))
    middle = [k for number, k in enumerate(line) if number < 2 or layout.markers[names[k]].body != "head"]
    at_px = np.where(seen_in(tracked)[..., None], pixels_of(tracked), np.nan)[:, middle]  # (n, k, 2)
    seen = np.asarray(np.isfinite(at_px).all(axis=2))
    whole = np.flatnonzero(seen.all(axis=1))
    if len(middle) < 4 or not len(whole):
        return []
    steps_px = np.linalg.norm(np.diff(at_px[whole[0]], axis=0), axis=1)
    along_px = np.append(0.0, np.cumsum(steps_px))
    wrong, sure = np.zeros_like(seen), np.zeros_like(seen)
    for mask, frames in rows_alike(seen):
        if mask.sum() >= 3:
            own = np.flatnonzero(mask)
            wrong[frames] = _impossible(at_px[frames], along_px, own)
            dots_px = at_px[np.ix_(frames, own)]
            sure[np.ix_(frames, own)] = _sure(dots_px, along_px, own)[:, None] & _fitting(dots_px, along_px, own)
    found_anew = _found_anew(seen)
    # Nose and neck have no others' places; one alone may have the other's.
    clear = seen & (tracked.confidence.values[:, middle] >= CLEARLY)
    found_anew[:, :2] = _found_anew(clear, HEAD_LOST_FRAMES)[:, :2] & ~clear[:, 1::-1]
    found_anew[: whole[0]] = False
    wrong = _lasting(widened(wrong, wrong, JOINED) | (found_anew & ~sure), seen & ~sure)
    wrong = _joined_to(wrong, seen & ~sure, at_px, along_px)
    return [
        Flag(
            "swap",
            (name,),
            span,
            f"{name} lies where order and distances along the body forbid it, or allow other names",
        )
        for column, name in enumerate(names[k] for k in middle)
        for span in stretches(wrong[:, column])
    ]


def strayed_flags(tracked: xr.Dataset, layout: RobotSpec, told: Iterable[Flag] = ()) -> list[Flag]:
    """Flag further markers of the head that leave their place on it, or are found again off it after a while.

    They ride on the head: their place is that before, against nose and neck. They are off it by more than `STRAYED` of
    the way to the nearest other marker, until they are back for some frames. A high one moves against nose and neck as
    the head crosses the picture (parallax).

    Args:
        tracked: the tracked trial.
        layout: the robot.
        told: flags of samples that are not judged again.
    """
    names, seen = markers_of(tracked), np.array(seen_in(tracked))
    for flag in told:
        first, last = flag.frames or (0, len(seen) - 1)
        seen[first : last + 1, [names.index(name) for name in flag.markers]] = False
    nose, neck = names.index("nose"), names.index("neck")
    at_px = np.where(seen[..., None], pixels_of(tracked), np.nan) @ [1.0, 1j]  # (n, m)
    axis = at_px[:, nose] - at_px[:, neck]
    axis[~np.isfinite(axis) | (axis == 0)] = np.inf  # nothing is off its place on a head of which nothing is known
    flags = []
    for marker, name in enumerate(names):
        known = np.asarray(seen[:, [nose, neck, marker]].all(axis=1))
        if name not in HEAD_MARKERS and layout.markers[name].body == "head" and known.any():
            place = np.where(known, at_px[:, marker] - at_px[:, neck], 0.0) / axis
            others = np.abs(np.delete(at_px, marker, axis=1) - at_px[:, [marker]])[known] / np.abs(axis[known, None])
            others = others[:, np.isfinite(others).any(axis=0)]
            above_m = np.ptp(layout.marker_positions_m((name, "neck"))[:, 2])
            most = STRAYED * float(np.nanmin(np.nanmedian(others, axis=0)))
            spans = _strayed(place, known, most, above_m / NEAREST_CAMERA_M * at_px[:, neck] / np.abs(axis))
            flags += [Flag("swap", (name,), span, f"{name} is off its place on the head") for span in spans]
    return flags


def _strayed(place: np.ndarray, known: np.ndarray, most: float, shift: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and last frames of stretches in which a place is off.

    Args:
        place: (n,) complex place on the head, from the neck, in lengths of nose to neck.
        known: (n,) whether it is known.
        most: largest distance from its usual place that is not off, in the same unit.
        shift: (n,) complex shift that parallax may give it where the head is, in the same unit.
    """
    spans = []
    for first, last in stretches(~known, LOST_FRAMES):
        before = place[:first][known[:first]][-RECENT_FRAMES:]
        if len(before):
            usual, after = _middle(before), slice(last + 1, None)
            allowed = most + np.abs(shift[after] - shift[:first][known[:first]][-1])
            off = np.asarray(known[after] & (np.abs(place[after] - usual) > allowed))
            back = stretches(known[after] & ~off, BACK_FRAMES)
            end = last + back[0][0] if back else len(place) - 1
            if off[: end - last].any():
                spans.append((last + 1, end))
    judged = known.copy()
    for first, last in spans:
        judged[first : last + 1] = False
    return [*spans, *_stepped_aside(place, judged, most)]


def _stepped_aside(place: np.ndarray, known: np.ndarray, most: float) -> list[tuple[int, int]]:
    """Return the stretches in which a place is off that of the frames before, until it is back; as for `_strayed`."""
    frames, spans = np.flatnonzero(known), []
    at, number, begun = place[frames], 0, 0
    if len(at) > RECENT_FRAMES:
        most = max(most, TIMES_USUAL * float(np.median(np.abs(at[BACK_FRAMES:] - at[:-BACK_FRAMES]))))
    while number < len(frames):
        if number and frames[number] - frames[number - 1] > LOST_FRAMES:
            begun = number  # `_strayed` judges what is found again
        recent, now = at[max(number - RECENT_FRAMES, begun) : number], at[number : number + 2]
        if len(recent) == RECENT_FRAMES and np.abs(now - _middle(recent)).min() > most:
            back = stretches(np.abs(at[number:] - _middle(recent)) <= most, BACK_FRAMES)
            end = number + back[0][0] if back else len(frames)
            spans.append((int(frames[number]), int(frames[end]) - 1 if back else len(place) - 1))
            number = begun = end
        else:
            number += 1
    return spans


def _middle(place: np.ndarray) -> complex:
    """Return the median of complex places."""
    return complex(np.median(place.real), np.median(place.imag))


def _mid_line(place_m: np.ndarray) -> list[int]:
    """Return the numbers of the markers on the mid line, of those at (m, 3), from the nose on."""
    return [int(k) for k in np.argsort(place_m[:, 0], kind="stable") if abs(place_m[k, 1]) < MIDDLE_M]


def _impossible(at_px: np.ndarray, along_px: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Tell (f, k) which markers are impossible, of those seen (s,) in all of these frames.

    Args:
        at_px: (f, k, 2) markers of the mid line.
        along_px: (k,) their places along the body.
        seen: (s,) numbers of those that are seen.
    """
    found, dots_px = np.zeros(at_px.shape[:2], bool), at_px[:, seen]
    bad = _contradicts(dots_px, along_px, seen)
    doubtful = np.flatnonzero(~bad & (_departure(dots_px, along_px, seen) > LIKELIER_NAMES))
    if len(doubtful):
        bad[doubtful] = _gain_by_other_names(dots_px[doubtful], along_px, seen) > LIKELIER_NAMES
    frames = np.flatnonzero(bad)
    found[np.ix_(frames, seen[seen > 1])] = True
    mended = np.zeros((len(frames), len(seen)), bool)
    for one in range(len(seen) if len(frames) and len(seen) > 3 else 0):
        mended[:, one] = _sure(np.delete(dots_px[frames], one, axis=1), along_px, np.delete(seen, one))
    by_one = mended.any(axis=1)
    found[frames[by_one]] = False
    found[np.ix_(frames[by_one], seen)] = mended[by_one]
    return found


def _found_anew(seen: np.ndarray, least: int = LOST_FRAMES) -> np.ndarray:
    """Tell in which frames markers (n, k) are seen again after so many without them or more."""
    found = np.zeros_like(seen)
    for column in range(seen.shape[1]):
        for _, last in stretches(~seen[:, column], least):
            found[last + 1 : last + 2, column] = True
    return found


def _lasting(wrong: np.ndarray, goes_on: np.ndarray) -> np.ndarray:
    """Return what is wrong (n, k), and each marker after it for as long as it is followed and no names are sure.

    A marker that is followed from a wrong dot on is still at that dot where too few others are seen to tell.

    Args:
        wrong: (n, k) samples that are wrong.
        goes_on: (n, k) samples that are seen, in frames whose names are not sure.
    """
    found, frames = wrong.copy(), np.arange(len(wrong))
    for column in range(wrong.shape[1]):
        for _, last in stretches(wrong[:, column]):
            stops = frames[~goes_on[:, column] & (frames > last)]
            found[last : stops[0] if len(stops) else len(wrong), column] = True
    return found


def _joined_to(wrong: np.ndarray, unsure: np.ndarray, at_px: np.ndarray, along_px: np.ndarray) -> np.ndarray:
    """Return what is wrong (n, k), and each marker that lies one step of the body from such ones.

    Names that are shifted along the body are shifted together: their steps are right. Two of them tell, or one where
    the name is unsure.

    Args:
        wrong: (n, k) samples that are wrong.
        unsure: (n, k) samples whose names are not sure.
        at_px: (n, k, 2) markers of the mid line.
        along_px: (k,) their places along the body.
    """
    scale = np.maximum(np.linalg.norm(at_px[:, 1] - at_px[:, 0], axis=1), 1.0) / max(along_px[1], 1.0)  # (n,)
    ratio = np.linalg.norm(np.diff(at_px, axis=1), axis=2) / np.maximum(np.diff(along_px), 1.0) / scale[:, None]
    joined = np.abs(np.nan_to_num(np.log(np.maximum(ratio, 1e-9)), nan=np.inf)) < ONE_STEP  # (n, k - 1)
    found, last = wrong.copy(), wrong.shape[1] - 1
    for line in (range(2, last + 1), range(last, 1, -1)):
        run = np.zeros(len(wrong), int)  # wrong ones in a row, one step apart
        for before, after in pairwise(line):
            run = np.where(found[:, before], run + 1, 0)
            run[~joined[:, min(before, after)]] = 0
            found[:, after] |= (run > 1) | ((run == 1) & unsure[:, after])
    return found


def _sure(dots_px: np.ndarray, along_px: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Tell (f,) in which frames dots have possible places, and any other names fit far worse; as `_contradicts`."""
    others_fit_worse = _gain_by_other_names(dots_px, along_px, names) < -SURE_NAMES
    return np.asarray(others_fit_worse & ~_contradicts(dots_px, along_px, names))


def _fitting(dots_px: np.ndarray, along_px: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Tell (f, s) which dots are where the distances to the others put them; as `_contradicts`."""
    own = _departure(dots_px, along_px, names)
    without = [
        _departure(np.delete(dots_px, one, axis=1), along_px, np.delete(names, one)) for one in range(len(names))
    ]
    return np.asarray(own - np.array(without) <= MOST_ADDED).T


def _gain_by_other_names(dots_px: np.ndarray, along_px: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Return by how much (f,) the best other names in order depart less; as for `_contradicts`."""
    head = (0, 1) if tuple(names[:2]) == (0, 1) else ()
    tails = combinations(range(len(head), len(along_px)), len(names) - len(head))
    others = (np.array([*head, *tail], dtype=int) for tail in tails)
    least = [_departure(dots_px, along_px, other) for other in others if (other != names).any()]
    own = _departure(dots_px, along_px, names)
    return own - np.min(least, axis=0) if least else np.full(len(own), -np.inf)


def _contradicts(dots_px: np.ndarray, along_px: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Tell (f,) in which frames two neighbours among dots (f, s, 2) are too near, too far, or folded back.

    Args:
        dots_px: the dots that carry the names, from the nose on.
        along_px: (k,) places of all names along the body.
        names: (s,) numbers of the names.
    """
    step_px = np.diff(dots_px, axis=1)  # (f, s - 1, 2)
    length_px = np.maximum(np.linalg.norm(step_px, axis=2), 1e-9)
    across = (step_px[:, :-1] * step_px[:, 1:]).sum(axis=2) / (length_px[:, :-1] * length_px[:, 1:])
    folded = (across < np.cos(np.deg2rad(FOLD_DEG))).any(axis=1)
    return np.asarray(folded | (_departure(dots_px, along_px, names) > MOST_DEPARTURE))


def _departure(dots_px: np.ndarray, along_px: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Return the sum (f,) of squares of what steps depart by, in standard deviations; as for `_contradicts`."""
    missed, usual_px = np.diff(names), np.maximum(np.diff(along_px[names]), 1.0)  # (s - 1,)
    ratio = np.maximum(np.linalg.norm(np.diff(dots_px, axis=1), axis=2), 1e-9) / usual_px
    has_head = tuple(names[:2]) == (0, 1)
    scale = ratio[:, :1] if has_head else np.median(ratio, axis=1, keepdims=True)  # the head does not bend
    half = np.deg2rad(BEND_DEG) / 2
    chord_over_arc = np.abs(np.sin(missed * half) / (missed * np.sin(half)))
    if names[-1] == len(along_px) - 1:
        chord_over_arc[-1] = min(chord_over_arc[-1], SHORTEST_FIN)
    off, placed_in_px = np.log(ratio / scale), np.maximum(scale, 0.5) * usual_px  # a head of no length has no scale
    beyond = np.where(off > 0, off, np.minimum(off - np.log(chord_over_arc), 0.0))
    return np.asarray(((beyond / np.hypot(STEP_SD, PLACED_PX / placed_in_px)) ** 2).sum(axis=1))


def exchanged_apart(tracked: xr.Dataset, layout: RobotSpec) -> tuple[Flag, ...]:
    """Flag exchanges in imported tracks, of markers that are as far apart as usual, not on one spot."""
    names, position = markers_of(tracked), pixels_of(tracked)
    found = _renamed(tracked, layout)
    for flag in exchange_flags(tracked, layout):
        one, other = (names.index(marker) for marker in flag.markers)
        apart, (first, last) = np.linalg.norm(position[:, one] - position[:, other], axis=1), flag.frames or (0, -1)
        as_usual = np.nanmedian(apart[first : last + 1]) > APART * np.nanmedian(apart)
        if last - first + 1 >= LEAST_FRAMES and as_usual and not any(_spans(each, flag) for each in found):
            found.append(flag)
    return tuple(sorted(found, key=lambda flag: flag.frames or (-1, -1)))


def _spans(flag: Flag, other: Flag) -> bool:
    """Tell whether most of the frames of another flag are among those of a flag: with wrong names it says nothing."""
    (first, last), (begin, end) = flag.frames or (0, -1), other.frames or (0, -1)
    return 2 * (min(last, end) - max(first, begin) + 1) > end - begin + 1


def _renamed(tracked: xr.Dataset, layout: RobotSpec) -> list[Flag]:
    """Flag each stretch in which names sit on one another's markers.

    Where names change places, the markers jump as they are named, and hardly move if they are named otherwise. Of the
    namings that follow one another that is right whose line along the body is the shortest.
    """
    names, position = markers_of(tracked), pixels_of(tracked)
    namings, since = [np.arange(len(names))], [0]  # the dot of the first frame that each marker names
    for frame, moved in _moves(position):
        naming = namings[-1].copy()
        naming[moved] = namings[-1]
        namings.append(naming)
        since.append(frame)
    if len(namings) == 1:
        return []
    which = np.searchsorted(since, np.arange(len(position)), side="right") - 1  # (n,) the naming of each frame
    dots = np.take_along_axis(position, np.argsort(namings, axis=1)[which][..., None], axis=1)
    place = layout.marker_positions_m(names)
    middle = _mid_line(place)
    length = [np.nansum(np.linalg.norm(np.diff(dots[:, naming[middle]], axis=1), axis=2)) for naming in namings]
    right = namings[int(np.argmin(np.round(length, 3)))]
    flags = []
    for naming, first, end in zip(namings, since, [*since[1:], len(position)], strict=True):
        if (wrong := naming != right).any():
            concerned = tuple(np.array(names, dtype=object)[wrong].tolist())
            message = f"{', '.join(concerned[:-1])} and {concerned[-1]} seem to be exchanged"
            flags.append(Flag("swap", concerned, (first, end - 1), message))
    return flags


def _moves(position: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """List the frames at which markers (n, m, 2) change names, and (m,) the name that each then has."""
    step = np.nan_to_num(np.linalg.norm(np.diff(position, axis=0), axis=2))  # (n - 1, m)
    apart = np.linalg.norm(position[:, :, None] - position[:, None], axis=3)
    nearest = np.where(apart > 0, np.nan_to_num(apart, nan=np.inf), np.inf).min(axis=2)
    found: list[tuple[int, np.ndarray]] = []
    for before in np.flatnonzero((step > APART * nearest[:-1]).sum(axis=1) > 1).tolist():
        known = np.flatnonzero(np.isfinite(position[before : before + 2]).all(axis=(0, 2)))
        here = position[before, known]
        ahead = here  # as if they moved on evenly, where the names are those of the frame before
        if not (found and found[-1][0] == before):
            ahead = here + np.nan_to_num(here - position[max(before - 1, 0), known])
        away = np.linalg.norm(ahead[:, None] - position[before + 1, known], axis=2)
        chosen = linear_sum_assignment(away)[1]
        changed = chosen != np.arange(len(known))
        if changed.any() and away[changed, chosen[changed]].sum() < RENAMED * np.diagonal(away)[changed].sum():
            moved = np.arange(position.shape[1])
            moved[known] = known[chosen]
            found.append((before + 1, moved))
    return found


def _exchanged(position: np.ndarray, order: list[int]) -> list[tuple[tuple[int, int], np.ndarray]]:
    """List the pairs of markers in an order (n, m, 2) that are exchanged, and in which frames (n,)."""
    found: list[tuple[tuple[int, int], np.ndarray]] = []
    for _ in order[1:]:
        gains = {pair: _shorter_by(position, order, *pair) for pair in combinations(order, 2)}
        gains = {pair: gain for pair, gain in gains.items() if stretches(gain > 0, EXCHANGE_FRAMES)}
        if not gains:
            break
        (a, b), gain = max(gains.items(), key=lambda item: float(item[1].sum()))
        found.append(((a, b), gain > 0))
        position = np.array(position)
        position[gain > 0, a], position[gain > 0, b] = position[gain > 0, b], position[gain > 0, a]
    return found


def _shorter_by(position: np.ndarray, order: list[int], a: int, b: int) -> np.ndarray:
    """Return by how much (n,) exchanging a and b shortens the line through them, px; 0 below `EXCHANGE` of |a b|."""
    ends = {place + side for place in (order.index(a), order.index(b)) for side in (-1, 0) if place + side >= 0}
    steps = [(order[i], order[i + 1]) for i in sorted(ends) if i + 1 < len(order)]
    other = {a: b, b: a}

    def length(lines: list[tuple[int, int]]) -> np.ndarray:
        return np.sum([np.linalg.norm(position[:, one] - position[:, two], axis=1) for one, two in lines], axis=0)

    exchanged = [(other.get(one, one), other.get(two, two)) for one, two in steps]
    gain = length(steps) - length(exchanged)  # nan where one of them is missing
    apart = np.linalg.norm(position[:, a] - position[:, b], axis=1)
    with np.errstate(invalid="ignore"):
        return np.where(gain > EXCHANGE * apart, gain, 0.0)


def _sides(place: np.ndarray) -> list[tuple[int, int]]:
    """List pairs of markers that mirror each other."""
    return [
        (a, b)
        for a in range(len(place))
        for b in range(len(place))
        if place[a, 1] < -1e-6 and np.allclose(place[a] * [1, -1, 1], place[b])
    ]


def _mirrored(position: np.ndarray, order: list[int], left: int, right: int) -> np.ndarray:
    """Tell (n,) whether a left marker is to the right, seen along the first two of the mid line; image y runs down."""
    axis = position[:, order[1]] - position[:, order[0]]
    across = position[:, right] - position[:, left]
    return axis[:, 0] * across[:, 1] - axis[:, 1] * across[:, 0] > 0
