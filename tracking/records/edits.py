"""Replay of the edit log on a tracked trial: it makes a copy, and never changes the tracker's own samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from session import Flag
from session.tracks import markers_of
from tracking.boxes import Box
from tracking.records.edit import Drop, Relabel, SetBox, Swap
from tracking.records.edit_log import EditLog, LoggedEdit
from tracking.records.tracked import NO_SAMPLE, ONLY_CSRT, SampleState, only_csrt_flags, samples_of, with_samples

Retracker = Callable[[np.ndarray, int, SetBox], tuple[np.ndarray, tuple[Flag, ...]]]
"""Function that tracks a marker on from a box set by hand.

It takes the places (n, m, 2) of all markers, px, the number of the one, and its box; it gives the samples, (f,) of
`SAMPLE`, of that marker in the frames after the box, and what is doubtful.
"""


def apply_edits(tracked: xr.Dataset, log: EditLog, retrack: Retracker | None = None) -> xr.Dataset:
    """Replay the edits that count, in the order of the log.

    A sample that is swapped or relabelled keeps its state, confidence and size under its new name; one that is dropped
    is MISSING. A box set by hand makes the sample of its frame BY_HAND with confidence 1, at the centre of the box; the
    frames after it are what `retrack` finds, or stay as they are without one. Each edit leaves a flag ``edited`` that
    names it. Flags ``only_csrt`` go with their samples; other flags of the tracker stay: judge the quality again after
    the edits.

    Args:
        tracked: the trial as tracked.
        log: its edits.
        retrack: tracks a marker on from a box set by hand.
    """
    if not log.in_force:
        return tracked
    names, samples = markers_of(tracked), samples_of(tracked)
    flags = [flag for flag in tracked.flags if flag.kind != ONLY_CSRT]
    for logged in log.in_force:
        flags.append(_describe_edit(logged, len(samples)))
        match logged.edit:
            case Swap(markers=(a, b), span=span):
                pair = [names.index(a), names.index(b)]
                samples[span, pair] = samples[span, pair[::-1]]
            case Drop(markers=markers, span=span):
                samples[span, [names.index(name) for name in markers]] = NO_SAMPLE
            case Relabel(marker=marker, to=to, span=span):
                samples[span, names.index(to)] = samples[span, names.index(marker)]
                samples[span, names.index(marker)] = NO_SAMPLE
            case SetBox(marker=marker, frame=frame) as box:
                k = names.index(marker)
                samples[frame, k] = (Box(*box.box).centre_px, 1.0, SampleState.BY_HAND, np.nan, False)
                if retrack is not None:
                    found, new_flags = retrack(samples["position_px"], k, box)
                    samples[frame + 1 : frame + 1 + len(found), k] = found
                    flags += new_flags
    return with_samples(tracked, samples, (*only_csrt_flags(samples["by_csrt"], names), *flags))


def _describe_edit(logged: LoggedEdit, frames: int) -> Flag:
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
