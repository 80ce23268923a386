"""Replaying the edit log on a tracked trial. The tracker's own samples are never changed; this makes a copy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from session import Flag
from tracking.records.edit import Drop, Relabel, SetBox, Swap
from tracking.records.edit_log import EditLog, LoggedEdit
from tracking.records.tracked import SampleState, TrackedTrial
from tracking.suspects import stretches

ONLY_CSRT = "only_csrt"


def only_csrt_flags(by_csrt: np.ndarray, markers: Sequence[str]) -> tuple[Flag, ...]:
    """One flag for each stretch of each marker in (n, m)."""
    return tuple(
        Flag(ONLY_CSRT, (name,), span, f"no spot answers, only CSRT sees {name}")
        for k, name in enumerate(markers)
        for span in stretches(by_csrt[:, k])
    )


def seen_only_by_csrt(flags: Iterable[Flag], frames: int, markers: Sequence[str]) -> np.ndarray:
    """(n, m) bool, what `only_csrt_flags` was made from."""
    by_csrt = np.zeros((frames, len(markers)), dtype=bool)
    for flag in flags:
        if flag.kind == ONLY_CSRT and flag.frames is not None:
            by_csrt[flag.frames[0] : flag.frames[1] + 1, [markers.index(name) for name in flag.markers]] = True
    return by_csrt


class Retrack(NamedTuple):
    """A marker to be tracked on from a box set by hand.

    Attributes:
        marker: its name.
        frame: the frame of the box.
        box: x, y of the top left pixel, width and height, px.
        until: the last frame to track on to; None leaves it to the tracker.
    """

    marker: str
    frame: int
    box: tuple[float, float, float, float]
    until: int | None


Retracker = Callable[[TrackedTrial, Retrack], TrackedTrial]
"""Tracks one marker on. What it says of other markers, of frames up to the box or after `until` is not used."""


def retracks(log: EditLog) -> tuple[Retrack, ...]:
    """The boxes set by hand that count, in the order of the log."""
    return tuple(_retrack(edit) for _, edit in log.in_force if isinstance(edit, SetBox))


def apply_edits(tracked: TrackedTrial, log: EditLog, retrack: Retracker | None = None) -> TrackedTrial:
    """Replays the edits that count, in the order of the log.

    A sample that is swapped or relabelled keeps its state, confidence and size under its new name; one that is
    dropped is MISSING. A box set by hand makes the sample of its frame BY_HAND with confidence 1, at the centre of
    the box; the frames after it are what `retrack` says, or stay as they are without one. Each edit leaves a flag
    ``edited`` that names it. Flags ``only_csrt`` go with their samples; other flags of the tracker stay: judge the
    quality again after the edits.

    Args:
        tracked: as the tracker left it.
        log: read for the markers and frames of this trial.
        retrack: tracks a marker on from a box set by hand.

    Raises:
        ValueError: the log names a marker or frame that the trial does not have.
    """
    for logged in log.in_force:
        _check_fits(tracked, logged)
        samples = _Samples.of(tracked)
        names = tracked.tracks.markers
        match logged.edit:
            case Swap(markers=(a, b), span=span):
                samples.move(span, (names.index(a), names.index(b)), (names.index(b), names.index(a)))
            case Drop(markers=markers, span=span):
                samples.drop(span, tuple(names.index(name) for name in markers))
            case Relabel(marker=marker, to=to, span=span):
                samples.move(span, (names.index(marker),), (names.index(to),))
                samples.drop(span, (names.index(marker),))
            case SetBox(marker=marker, frame=frame) as box:
                samples.set_by_hand(frame, names.index(marker), box.centre_px)
        tracked = samples.into(tracked, (*tracked.flags, _edited(logged, len(tracked.state))))
        if isinstance(logged.edit, SetBox) and retrack is not None:
            tracked = _tracked_on(tracked, _retrack(logged.edit), retrack)
    return tracked


@dataclass(frozen=True, eq=False)
class _Samples:
    """A copy of a trial's samples to work on; shapes as in `TrackedTrial`."""

    position_px: np.ndarray
    confidence: np.ndarray
    state: np.ndarray
    size_px: np.ndarray
    by_csrt: np.ndarray  # (n, m) bool, only CSRT saw it

    @classmethod
    def of(cls, tracked: TrackedTrial) -> _Samples:
        return cls(
            tracked.tracks.position_px.copy(),
            tracked.tracks.confidence.copy(),
            tracked.state.copy(),
            tracked.size_px.copy(),
            seen_only_by_csrt(tracked.flags, len(tracked.state), tracked.tracks.markers),
        )

    def into(self, tracked: TrackedTrial, flags: tuple[Flag, ...]) -> TrackedTrial:
        others = tuple(flag for flag in flags if flag.kind != ONLY_CSRT)
        flags = (*only_csrt_flags(self.by_csrt, tracked.tracks.markers), *others)
        return tracked.with_samples(self.position_px, self.confidence, self.state, self.size_px, flags)

    def move(self, span: slice, sources: tuple[int, ...], targets: tuple[int, ...]) -> None:
        for array in (self.position_px, self.confidence, self.state, self.size_px, self.by_csrt):
            array[span, targets] = array[span, sources]

    def drop(self, span: slice, markers: tuple[int, ...]) -> None:
        self.position_px[span, markers] = np.nan
        self.confidence[span, markers] = 0.0
        self.state[span, markers] = SampleState.MISSING
        self.size_px[span, markers] = np.nan
        self.by_csrt[span, markers] = False

    def set_by_hand(self, frame: int, marker: int, centre_px: tuple[float, float]) -> None:
        self.position_px[frame, marker] = centre_px
        self.confidence[frame, marker] = 1.0
        self.state[frame, marker] = SampleState.BY_HAND
        self.size_px[frame, marker] = np.nan
        self.by_csrt[frame, marker] = False

    def take(self, span: slice, marker: int, other: TrackedTrial) -> None:
        self.position_px[span, marker] = other.tracks.position_px[span, marker]
        self.confidence[span, marker] = other.tracks.confidence[span, marker]
        self.state[span, marker] = other.state[span, marker]
        self.size_px[span, marker] = other.size_px[span, marker]
        by_csrt = seen_only_by_csrt(other.flags, len(other.state), other.tracks.markers)
        self.by_csrt[span, marker] = by_csrt[span, marker]


def _tracked_on(tracked: TrackedTrial, wanted: Retrack, retrack: Retracker) -> TrackedTrial:
    samples = _Samples.of(tracked)
    span = slice(wanted.frame + 1, None if wanted.until is None else wanted.until + 1)
    found = retrack(tracked, wanted)
    samples.take(span, tracked.tracks.markers.index(wanted.marker), found)
    new_flags = tuple(flag for flag in found.flags if flag not in tracked.flags)
    return samples.into(tracked, (*tracked.flags, *new_flags))


def _retrack(edit: SetBox) -> Retrack:
    return Retrack(edit.marker, edit.frame, edit.box, edit.until)


def _edited(logged: LoggedEdit, frames: int) -> Flag:
    line, edit = logged
    match edit:
        case Swap(markers=(a, b)):
            what = f"{a} and {b} swapped"
        case Drop(markers=markers):
            what = f"{', '.join(markers)} dropped"
        case Relabel(marker=marker, to=to):
            what = f"{marker} relabelled as {to}"
        case _:
            what = f"{', '.join(edit.named)} set"
    first, *last = edit.framed
    to_the_end = not isinstance(edit, SetBox)
    stop = last[0] if last else frames - 1 if to_the_end else first
    why = f": {edit.note}" if edit.note else ""
    return Flag("edited", edit.named, (first, stop), f"{what} by hand (line {line} of the edit log){why}")


def _check_fits(tracked: TrackedTrial, logged: LoggedEdit) -> None:
    unknown = [name for name in logged.edit.named if name not in tracked.tracks.markers]
    beyond = [str(frame) for frame in logged.edit.framed if frame >= len(tracked.state)]
    if unknown or beyond:
        raise ValueError(
            f"line {logged.line} of the edit log names {', '.join([*unknown, *beyond])}; the trial has the markers "
            f"{', '.join(tracked.tracks.markers)} and {len(tracked.state)} frames"
        )
