"""Frames that the film itself spoils: damaged and repeated ones.

`missing_at_the_end`, `lost_frames` and `suspect_frames` report what of a damaged file is lost. `Repeats` finds pictures
that repeat the one before: a film stored at a higher frame rate than it was taken at. `frozen_picture` and
`repeated_rows` find the same by markers that do not move. `stretches` splits such frames into runs.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping

import av
import cv2
import numpy as np

from swimcal.flags import Flag
from tracking.decoding import AVI, FrameIndex

# Damaged files.
MP4 = "mov,mp4,m4a,3gp,3g2,mj2"
MATROSKA = "matroska,webm"
"""Names FFmpeg gives its readers of these containers."""
RANGES_SHOWN = 5
"""Spell out so many stretches of lost frames, and count the rest."""
SHORT_BY_FRAMES = 2.5
"""A file may end this many frames before the duration in its header (rounding, the last frame's own duration)."""
TICKS = 1.5
"""From so many ticks a frame on, an AVI's clock is finer than its frames."""
AT_THE_END, BEFORE_THE_END = 4, 12
"""Where none but the last so many frames of a file are lost it was cut short, and so many more may be harmed."""
SHORT_WITH_SOUND_S = 1.0
"""The first in seconds where sound or other streams may be longer than the picture."""
AGAIN = "copy it again from the card"

# `Repeats`: pictures that repeat the one before.
REPEATS = 0.05
"""A picture that differs from the one before by less than this share of what is usual repeats it."""
MOVING = 4.0
"""Steps of luma by which the usual difference must stand out, or nothing moves and nothing can be told."""
GOES_ON = 0.3
"""After repeats a picture differs by this share of what is usual, or it was the robot that stood still."""
LONGEST = 4
"""More repeats on end are a picture that stands still, or a robot."""
USUAL_OVER = 24
"""Pictures over which the usual difference is taken."""
ROWS = 360
"""Rows of a picture that are compared, about."""
MARGIN_PX = 24.0
"""Around each marker within which pictures are compared; the one that differs most counts."""
EDGES = 0.99
"""Quantile of the differences that is compared: a dot that moves by a pixel differs at its rim alone."""
OFTEN = 0.1
"""A film repeats pictures where this share of them does, …"""
AT_LEAST = 3
"""… and so many."""
UNMOVED, NEARBY = 0.2, 6
"""In such a film a frame repeats the one before, too, where all markers move less than this share of what they usually
do within so many frames, …"""
CODED_ANEW_PX = 1.0
"""… and by no more than a picture that is coded anew moves them: a tail that turns back goes further."""

# Pictures that stand still, told by the markers.
FROZEN_FRAMES = 6
"""The picture is frozen if no marker at all moves for so many frames …"""
FROZEN_MOTION_PX = 2.0
"""… and just before or after one moves by this in a frame; …"""
FROZEN_BETWEEN = 4
"""… for so many, if one moves so both before and after."""
SAME_PX = 0.02
"""No marker moves that far in a frozen picture that is coded anew, if one moves both before and after; else none moves
at all."""
CHANGING = 0.4
"""So many of the numbers that say where the markers are change around a picture that is repeated, on the mean of some
steps before and of some after, and half as many in each. They do in the real trials; rounded to a hundredth of the
robot's length, markers all stand still together only where 0.3 change."""
AROUND = 2
"""Number of these steps."""
WIDELY = 12
"""Number of steps before and of steps after that say how often markers repeat by chance."""
BY_CHANCE = 0.05
"""So many frames of a trial may repeat by chance, as they do where few markers are rounded, and count as repeated."""
TURNS_BACK = -0.8
"""Cosine between the steps before and after frames without motion, below which the tail turned back between them."""
MOSTLY = 0.5
"""Share of such turns from which frames without motion are those of a beat, not of a film of another rate."""
ACROSS = 3
"""Frames before and after a stretch that stands still, through whose places parabolas are laid."""
STOPPED = 1.5
"""A picture that stood still goes on where it stopped if the parabolas leave less than so many times the squares when
that time is left out. Of stretches of 3 to 8 frames put into the real trials, 2 of 1,686 stopped films are missed, and
none of 1,728 others is taken for one; of single frames at 60 frames a second, more than a quarter is."""


def stretches(mask: np.ndarray, least: int = 1) -> list[tuple[int, int]]:
    """List the first and last frame, both included, of each run of at least so many True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2) if last - first >= least]


def missing_at_the_end(index: FrameIndex, container: av.container.InputContainer, stream: av.VideoStream) -> str | None:
    """Say what the file's header declares beyond the packets that were found; None if nothing.

    MP4 and MOV list every packet, AVI counts them, or finer ticks of a clock, Matroska and WebM give a duration,
    transport streams nothing.
    """
    found, formats = len(index.time_s), container.format.name
    last_s = float(index.time_s[-1])
    frame_s = float(np.median(np.diff(index.time_s))) if found > 1 else np.inf
    counts_ticks = formats == AVI and frame_s * float(stream.average_rate or 0) > TICKS  # a tick may have no frame
    declared = {AVI: stream.frames, MP4: len(stream.index_entries)}.get(formats, 0)
    if declared > index.total_packets and not counts_ticks:
        return f"the file ends after {index.total_packets} of {declared} frames, at {last_s:.3f} s: {AGAIN}"
    if (formats == MATROSKA or counts_ticks) and container.duration and found > 1:
        allowed = SHORT_BY_FRAMES * frame_s if len(container.streams) == 1 else SHORT_WITH_SOUND_S
        declared_s = (container.duration - max(container.start_time or 0, 0)) / av.time_base  # it tells when it ends
        if declared_s - last_s > allowed:
            expected = found + round((declared_s - last_s) / frame_s) - 1
            ends = f"the file ends after {found} of about {expected} frames, at {last_s:.3f} s of {declared_s:.3f} s"
            return f"{ends}: {AGAIN}"
    if index.broke_off:
        return f"the file cannot be read beyond frame {found - 1}, at {last_s:.3f} s: {AGAIN}"
    return None


def lost_frames(lost: Iterable[int], index: FrameIndex) -> str | None:
    """Report which frames could not be decoded, and how many others that may have harmed; None if none."""
    numbers = sorted(lost)
    if not numbers:
        return None
    runs = stretches(np.isin(np.arange(len(index.time_s)), numbers))
    shown = ", ".join(_named(first, last, index) for first, last in runs[:RANGES_SHOWN])
    more = f" and {len(runs) - RANGES_SHOWN} more stretches" if len(runs) > RANGES_SHOWN else ""
    message = f"{len(numbers)} of {len(index.time_s)} frames cannot be decoded: {shown}{more}"
    harmed = int(np.sum(suspect_frames(numbers, index))) - len(numbers)
    return f"{message}; {harmed} others between the same key frames may show traces of that" if harmed else message


def suspect_frames(lost: Iterable[int], index: FrameIndex) -> np.ndarray:
    """Return (n,) bool, the frames that lean on a lost one, directly or not, and the lost ones themselves.

    Frames lean on each other between two key frames only, except that those shown shortly before a key frame may
    lean on it as well (an open group of pictures). Those before the end of a file that was cut short lean on nothing
    that is missing.
    """
    suspect = np.zeros(len(index.time_s), dtype=bool)
    lost = list(lost)
    if lost and min(lost) >= len(suspect) - AT_THE_END:
        suspect[max(min(lost) - BEFORE_THE_END, 0) :] = True
        return suspect
    for number in lost:
        first, after = index.group(number)
        if index.is_reordered and first == number > 0:
            first = index.group(number - 1)[0]
        suspect[first:after] = True
    return suspect


def _named(first: int, last: int, index: FrameIndex) -> str:
    name = f"{first}" if first == last else f"{first} to {last}"
    return f"{name} ({index.time_s[first]:.3f} s)"


class Repeats:
    """A search for pictures of a film, taken in order, that repeat the one before.

    Attributes:
        frames: the repeats so far after which the motion went on.
        skipped: all frames of which `repeats` said so.
    """

    def __init__(self) -> None:
        self.frames: list[int] = []
        self.skipped: set[int] = set()
        self._before: np.ndarray | None = None
        self._usual: deque[float] = deque(maxlen=USUAL_OVER)
        self._run: list[int] = []
        self._moved = True  # whether the last picture that repeated none had moved

    def state(self) -> dict[str, np.ndarray]:
        """Return all it knows, as arrays; `restored` makes the same of them."""
        kept = {
            "repeats": self.frames,
            "skipped": sorted(self.skipped),
            "repeats_run": self._run,
            "moved": [self._moved],
        }
        before = np.zeros((0, 0), np.uint8) if self._before is None else self._before
        pictures = {"usual": np.array(self._usual), "before": before}
        return {name: np.array(numbers, int) for name, numbers in kept.items()} | pictures

    @classmethod
    def restored(cls, kept: Mapping[str, np.ndarray]) -> Repeats:
        """Make it again of what `state` gave."""
        made = cls()
        made.frames, made.skipped = kept["repeats"].tolist(), set(kept["skipped"].tolist())
        made._run = kept["repeats_run"].tolist()
        made._moved = bool(kept["moved"][0])
        made._usual.extend(kept["usual"].tolist())
        made._before = kept["before"] if kept["before"].size else None
        return made

    def repeats(self, number: int, luma: np.ndarray, around_px: np.ndarray) -> bool:
        """Tell whether frame `number` (h, w) repeats the one before, around where the markers (m, 2) were last, px.

        While all of them are out of the picture none does: nothing in it need move.
        """
        step = max(1, round(luma.shape[0] / ROWS))
        now = luma[::step, ::step].copy()
        before, self._before = self._before, now
        if before is None:
            return False
        height, width = luma.shape
        known = around_px[((around_px >= 0) & (around_px < [width, height])).all(axis=1)] / step  # nan: not seen
        if not len(known):
            self._run, self._moved = [], False
            return False
        difference = max(_difference(now, before, at, MARGIN_PX / step) for at in known)
        usual = _quantile(self._usual, 0.75) if self._usual else 0.0
        same = difference <= REPEATS * usual if usual >= MOVING else difference == 0 and not self._usual
        if same and len(self._run) < LONGEST:
            self._run.append(number)
            self.skipped.add(number)
            return True
        moving = difference >= max(GOES_ON * usual, MOVING)
        if moving and self._moved:  # a robot that rests before it moves repeats its picture, too
            self.frames += self._run
        self._run, self._moved = [], moving
        self._usual.append(difference)
        return False

    @property
    def pending(self) -> tuple[int, ...]:
        """Return the last repeats so far, of which no later picture says whether the motion went on."""
        return tuple(self._run) if self._moved else ()

    def are_many(self, frames: int) -> bool:
        """Tell whether so many of the frames repeat the one before that the film was taken at another rate."""
        return len(self.frames) >= max(AT_LEAST, OFTEN * frames)


def unmoved_frames(position_px: np.ndarray, repeats: list[int]) -> list[int]:
    """List further frames that repeat the one before, of a film with `repeats`, by its markers (n, m, 2), px.

    Pictures that were compressed anew differ, and of the first one nothing is known to compare it with.
    """
    own = np.delete(np.arange(len(position_px)), repeats)
    with np.errstate(invalid="ignore"):
        steps = np.linalg.norm(np.diff(position_px[own], axis=0), axis=2)  # (k - 1, m)
    step_px = np.nanmax(np.nan_to_num(steps), axis=1, initial=0.0)
    found = []
    for k, step in enumerate(step_px):
        near = np.delete(step_px, k)[max(k - NEARBY, 0) : k + NEARBY]
        if len(near) and step < min(UNMOVED * np.median(near), CODED_ANEW_PX):
            found.append(int(own[k + 1]))
    return found


def _difference(now: np.ndarray, before: np.ndarray, at: np.ndarray, margin: float) -> float:
    """Measure how far two pictures (h, w) differ around a place (2,), in grey levels."""
    height, width = now.shape
    x, y = at.tolist()
    left, right = (min(max(int(x + side), 0), width) for side in (-margin, margin + 1))
    top, bottom = (min(max(int(y + side), 0), height) for side in (-margin, margin + 1))
    if left == right or top == bottom:
        return 0.0
    region = np.s_[top:bottom, left:right]
    return _quantile(cv2.absdiff(now[region], before[region]), EDGES)


def _quantile(values: Iterable[float] | np.ndarray, share: float) -> float:
    """Compute what `np.quantile` does; of few values it does so ten times as fast."""
    ordered = np.sort(np.asarray(values), axis=None)
    return float(np.interp(share * (len(ordered) - 1), np.arange(len(ordered)), ordered))


def frozen_picture(position_px: np.ndarray) -> np.ndarray:
    """Return (n,) frames within a long enough stretch in which the markers (n, m, 2) all stay where they are.

    A robot that comes to rest slows down; a picture that freezes does so from one frame to the next. The first frame of
    a stretch is a true picture and stays out. A marker that is missing counts as unmoved.
    """
    moved_px, same = _same_picture(position_px)
    result, changed = np.zeros(len(same), bool), _share_that_changes(position_px)
    for first, last in stretches(same):
        sides = moved_px[max(first - 3, 0) : first - 1], moved_px[last : last + 2]
        abrupt = [side.max(initial=0.0) >= FROZEN_MOTION_PX for side in sides]
        between = all(abrupt) or _moves_around(changed, first, last)
        if between or (any(abrupt) and not moved_px[first - 1 : last].any()):
            result[first : last + 1] = last - first + 2 >= (FROZEN_BETWEEN if between else FROZEN_FRAMES)
    return result


def stopped_clock(frozen: np.ndarray, position_px: np.ndarray) -> list[int]:
    """List the frames in which markers (n, m, 2) go on after a frozen stretch as if no time had passed.

    A robot that went on while its picture froze is further on its way then, by all the time between.
    """
    return [last + 1 for first, last in stretches(frozen) if _goes_on_where_it_stopped(position_px, first, last)]


def _goes_on_where_it_stopped(position_px: np.ndarray, first: int, last: int) -> bool:
    """Tell whether parabolas through the frames around `first` to `last` fit better without the time between."""
    before, after = np.arange(max(first - ACROSS, 0), first), np.arange(last + 1, last + 1 + ACROSS)
    if len(before) < ACROSS or after[-1] >= len(position_px):
        return False
    places = position_px[np.concatenate([before, after])].reshape(2 * ACROSS, -1)  # (6, m * 2)
    places = places[:, np.isfinite(places).all(axis=0)]
    left = [
        np.linalg.lstsq(np.vander(frames - first, 3), places, rcond=None)[1].sum()
        for frames in (np.concatenate([before, after]), np.concatenate([before, after - (last - first + 1)]))
    ]
    return bool(places.size and left[1] < STOPPED * left[0])


def frozen_flags(frozen: np.ndarray, markers: tuple[str, ...], stopped: Collection[int], part: slice) -> list[Flag]:
    """Make a flag for each stretch (n,) in which the picture is frozen.

    Args:
        frozen: (n,) frames in which it is.
        markers: names of the markers.
        stopped: frames in which the motion goes on as if no time had passed.
        part: what counts of a trial then.
    """
    flags = []
    for first, last in stretches(frozen):
        message = f"no marker moves for {last - first + 1} frames: the video stands still or repeats itself"
        if last + 1 in stopped:
            message += f", and goes on where it stopped; only frames {part.start} to {part.stop - 1} count"
        flags.append(Flag("frozen_marker", markers, (first, last), message))
    return flags


def repeated_rows(position_px: np.ndarray) -> np.ndarray:
    """Return (n,) frames that repeat the one before amid the motion of markers (n, m, 2).

    Tracks that are stored at a higher rate than they were taken at do so often. Of single frames only those count
    around which the markers surely move.
    """
    moved_px, same = _same_picture(position_px)
    often, single = np.zeros((2, len(same)), bool)
    changed, back = _share_that_changes(position_px), []
    for first, last in stretches(same):
        sides = np.concatenate([moved_px[max(first - 2, 0) : first - 1], moved_px[last : last + 1]])
        often[first : last + 1] = last - first < LONGEST and sides.min(initial=np.inf) >= FROZEN_MOTION_PX
        turns = first >= 2 and last + 1 < len(same) and _turns_back(position_px, first, last)
        surely = _moves_around(changed, first, last) and not turns
        surely = surely and _repeats_by_chance(position_px, changed, first, last) < BY_CHANCE
        single[first : last + 1] = last - first + 2 < FROZEN_BETWEEN and surely
        if often[first]:
            back.append(turns)
    many = _are_many(often) and sum(back) < MOSTLY * len(back)
    return often if many else single


def repeat_flags(repeated: np.ndarray, position_px: np.ndarray) -> list[Flag]:
    """Make the flag for rows (n,) of markers (n, m, 2) that repeat the one before."""
    count, frames = int(repeated.sum()), len(repeated)
    if not count:
        return []
    if _are_many(repeated):
        message = (
            f"{count} of {frames} frames repeat the one before: the tracks are stored at a higher rate than they were "
            "taken at; these frames are left out"
        )
        return [Flag("repeated_frames", message=message)]
    runs = stretches(repeated)
    message = f"{count} of {frames} frames repeat the one before and are left out: "
    message += f"{', '.join(str(first) for first, _ in runs[:RANGES_SHOWN])}{', …' * (len(runs) > RANGES_SHOWN)}"
    stopped = stopped_clock(repeated, position_px)
    if late := sum(last - first + 1 for first, last in runs if last + 1 in stopped):
        message += (
            f"; the motion goes on as if no time had passed, so the beat may seem {100 * late / frames:.1f} % slow"
        )
    return [Flag("repeated_frames", frames=(runs[0][0], runs[-1][1]), message=message)]


def _are_many(repeated: np.ndarray) -> bool:
    return bool(repeated.sum() >= max(AT_LEAST, OFTEN * len(repeated)))


def _share_that_changes(position_px: np.ndarray) -> np.ndarray:
    """Return the share (n - 1,) of the numbers that say where markers (n, m, 2) are that change in each step."""
    step = np.abs(np.diff(position_px, axis=0))
    return (step > SAME_PX).sum(axis=(1, 2)) / np.maximum(np.isfinite(step).sum(axis=(1, 2)), 1)


def _moves_around(changed: np.ndarray, first: int, last: int) -> bool:
    """Tell whether the markers surely move before and after frames in which they do not.

    Args:
        changed: (n - 1,) share of their numbers that change in each step.
        first: first frame in which they do not move.
        last: last such frame.
    """
    before, after = changed[max(first - 1 - AROUND, 0) : first - 1], changed[last : last + AROUND]
    if not len(before) == len(after) == AROUND:
        return False
    return bool(min(before.mean(), after.mean()) >= CHANGING and min(*before, *after) >= CHANGING / 2)


def _repeats_by_chance(position_px: np.ndarray, changed: np.ndarray, first: int, last: int) -> float:
    """Return how many frames of a trial would repeat the one before by chance, as places may be rounded.

    Args:
        position_px: (n, m, 2) where the markers are.
        changed: (n - 1,) share of their numbers that change in each step.
        first: first frame in which they do not move.
        last: last such frame.
    """
    around = np.concatenate([changed[max(first - 1 - WIDELY, 0) : first - 1], changed[last : last + WIDELY]])
    numbers = int(np.isfinite(position_px[first]).sum())
    return float(len(position_px) * (1 - around.mean()) ** numbers)


def _turns_back(position_px: np.ndarray, first: int, last: int) -> bool:
    """Tell whether markers (n, m, 2) go back after frames in which they do not move.

    Where a beat has few frames, two of them may show a tail on its way out and back at the same place.

    Args:
        position_px: where the markers are.
        first: first frame in which they do not move; at least two come before.
        last: last such frame; one more comes after.
    """
    before, after = (np.nan_to_num(position_px[end] - position_px[end - 1]).ravel() for end in (first - 1, last + 1))
    return bool(before @ after < TURNS_BACK * np.linalg.norm(before) * np.linalg.norm(after))


def _same_picture(position_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest step (n - 1,) of markers (n, m, 2), px, and the frames (n,) in which none moves."""
    step = np.nan_to_num(np.abs(np.diff(position_px, axis=0)))
    moved_px = step.max(axis=(1, 2), initial=0.0)
    seen = np.isfinite(position_px).all(axis=2).any(axis=1)  # (n,)
    return moved_px, np.concatenate([[False], (moved_px <= SAME_PX) & seen[1:]])[: len(seen)]
