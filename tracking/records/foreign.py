"""Tracks of other programs: their samples are checked and converted, and each fault names its place in the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from session import FaultCollector
from session.errors import Fault, did_you_mean
from session.results import write_whole
from session.tracks import (
    FARTHEST_PX,
    NO_NAMES,
    as_tracks,
    check_count,
    check_pixels,
    check_seconds,
    check_seen,
    pixels_of,
)
from tracking.records.coarse_clock import even_times

SURE = 1.5
"""Scores of networks go a little beyond 1, which is taken as 1; percent are beyond this."""


@dataclass(frozen=True, eq=False)
class ForeignTracks:
    """Tracks of n frames and k markers as a file of another program holds them, under its own names.

    Attributes:
        file: the name for messages.
        word: the program's word for a marker.
        names: names of the k markers, in the order of the file.
        position_px: (n, k, 2), nan where missing.
        confidence: (n, k), nan where the file does not tell.
        where: the place of each frame in the file.
        time_s: (n,) s; None where the file has no time.
        frame: (n,) number of each frame, which counts where there is no time.
    """

    file: str
    word: str
    names: tuple[str, ...]
    position_px: np.ndarray
    confidence: np.ndarray
    where: Sequence[str]
    time_s: np.ndarray | None = None
    frame: np.ndarray | None = None

    def renamed(self, rename: Mapping[str, str]) -> tuple[str, ...]:
        """Return the markers' names in our terms; `rename` maps theirs to ours."""
        return tuple(rename.get(name, name) for name in self.names)

    def tracks(
        self, markers: Sequence[str], fps: float | None, faults: FaultCollector, rename: Mapping[str, str] = NO_NAMES
    ) -> xr.Dataset:
        """Return the tracks of m markers; other tracks of the file are dropped.

        A position with one half missing is missing altogether; a confidence that is missing is 1, 0 where the position
        is, and 1 where it is a little above that. Times rounded so coarsely that frames are uneven are made even.

        Args:
            markers: our names of the m markers.
            fps: frame rate; where the file has no time, frame k is at k / `fps`.
            faults: takes the faults.
            rename: from the file's names to ours.

        Raises:
            InputError: markers that are not there, no time and no `fps`, times that do not increase or are no seconds,
                places that are no pixels, confidences outside [0, 1], a marker that is missing throughout, less than
                two frames, and the faults that were there before.
        """
        names = self.renamed(rename)
        check_names(markers, names, self.word, faults, [name for name in rename if name not in self.names])
        if self.time_s is None and fps is None:
            faults.add("", "the file has no time", expected="the frame rate of the camera", next_step="Add `--fps 60`.")
        faults.raise_if_any()
        assert self.time_s is not None or (fps is not None and self.frame is not None)
        time_s = self.time_s if self.time_s is not None else np.asarray(self.frame, float) / (fps or np.nan)
        chosen = [names.index(marker) for marker in markers]
        position, confidence = self.position_px[:, chosen], self.confidence[:, chosen]
        found = checked_tracks(markers, time_s, position, confidence, self.where, faults)
        if self.time_s is None:
            return found
        even_s = even_times(found.time.values, fps, faults)
        return as_tracks(tuple(markers), even_s, pixels_of(found), found.confidence.values)


def check_names(
    markers: Sequence[str], found: Sequence[str], word: str, faults: FaultCollector, unused: Sequence[str] = ()
) -> None:
    """Add one fault for all markers that a file does not hold, and one for names to rename that it does not have.

    Args:
        markers: names that the file has to hold.
        found: names that it holds, after renaming.
        word: the file's word for a marker.
        faults: takes the faults.
        unused: names to rename that the file does not have.
    """
    theirs = list(dict.fromkeys(found))
    if unused:
        what, step = "no such name in the file to rename", did_you_mean(unused[0], theirs)
        faults.add("--rename", what, found=", ".join(unused), choices=tuple(theirs), next_step=step)
    missing = [marker for marker in markers if marker not in theirs]
    if not missing:
        return
    if len(missing) == 1 and (hint := did_you_mean(missing[0], theirs)):
        faults.add("", f"no {word} {missing[0]!r}", choices=tuple(theirs), next_step=hint)
        return
    free = [name for name in theirs if name not in markers]
    pairs = f"{free[0]}={missing[0]},…" if free else "theirs=ours,…"
    plural = f"{word[:-1]}ies" if word.endswith("y") else f"{word}s"
    faults.add(
        "",
        f"{len(missing)} {plural} are missing" if len(missing) < len(markers) else f"other {plural}",
        found=", ".join(theirs),
        expected=", ".join(markers),
        next_step=f"Give the others their names, in order of the body: `--rename {pairs}`, or rename them in the file.",
    )


def checked_tracks(
    markers: Sequence[str],
    time_s: np.ndarray,
    position_px: np.ndarray,
    confidence: np.ndarray,
    where: Sequence[str],
    faults: FaultCollector,
) -> xr.Dataset:
    """Check the samples of m markers, and return them as tracks.

    Args:
        markers: names of the m markers.
        time_s: (n,) times, s.
        position_px: (n, m, 2), px, nan where missing.
        confidence: (n, m), nan where unknown.
        where: place of each frame in the file, for messages.
        faults: takes the faults.

    Raises:
        InputError: every fault at once.
    """
    position = np.array(position_px, dtype=float)
    missing = np.isnan(position).any(axis=2)  # (n, m)
    position[missing] = np.nan
    belief = np.where(np.isnan(confidence), 1.0, confidence)
    belief = np.where(missing, 0.0, np.where((belief > 1) & (belief <= SURE), 1.0, belief))
    check_count(len(time_s), faults)
    check_seen(~missing, markers, faults)
    late = (1 + np.flatnonzero(~(np.diff(time_s) > 0))).tolist()
    outside = np.argwhere((belief < 0) | (belief > 1)).tolist()
    far = np.argwhere(np.abs(np.nan_to_num(position)).max(axis=2) > FARTHEST_PX).tolist()

    def fault(row: int, k: int | None, what: str, found: object, expected: str) -> Fault:
        place = where[row] if k is None else f"{where[row]}, {markers[k]}"
        return Fault(faults.file, place, what, f"{found}", expected)

    in_reach = f"pixels, no further than {FARTHEST_PX:g} from the corner"
    faults.extend_capped([fault(k, None, "time does not increase", time_s[k], f"after {time_s[k - 1]}") for k in late])
    faults.extend_capped([fault(k, i, "confidence out of range", belief[k, i], "0 to 1") for k, i in outside])
    faults.extend_capped([fault(k, i, "is beyond any image", position[k, i], in_reach) for k, i in far])
    if not faults:
        check_seconds(np.asarray(time_s, float), faults)
        check_pixels(position, faults)
    faults.raise_if_any()
    return as_tracks(tuple(markers), np.array(time_s, dtype=float), position, belief)


def save_fishsim(path: Path, tracks: xr.Dataset) -> None:
    """Write tracks in the authors' form, nan where missing, whole or not at all; `session.tracks.load_tracks` reads it.

    Times and confidences are lost.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    rows = pixels_of(tracks).reshape(len(tracks.time.values), -1).tolist()  # (n, 2 m)
    write_whole(path, "".join(",".join(map(repr, row)) + "\n" for row in rows))
