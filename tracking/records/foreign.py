"""What holds for tracks of other programs: the samples are made ours and checked, faults named by their place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from session import FaultCollector
from session.errors import Fault, did_you_mean
from session.results import write_whole
from session.tracks import FARTHEST_PX, as_tracks, check_count, check_seen, pixels_of


def check_names(markers: Sequence[str], found: Sequence[str], what: str, faults: FaultCollector) -> None:
    """Adds a fault for each marker that a file does not hold; `what` is its word for a marker."""
    for marker in markers:
        if marker not in found:
            hint = did_you_mean(marker, found) or "Rename it in the file, or in [markers] names of the session."
            faults.add("", f"no {what} {marker!r}", choices=dict.fromkeys(found), next_step=hint)


def checked_tracks(
    markers: Sequence[str],
    time_s: np.ndarray,
    position_px: np.ndarray,
    confidence: np.ndarray,
    where: Sequence[str],
    faults: FaultCollector,
) -> xr.Dataset:
    """Tracks of m markers from samples of another program, (n,), (n, m, 2) and (n, m), each frame at its place there.

    A position with one half missing is missing altogether; a confidence that is missing is 1, and 0 where the
    position is missing.

    Raises:
        InputError: times that do not increase, infinite or far away positions, confidences outside [0, 1], a marker
            that is missing throughout, less than two frames, and the faults that were there before.
    """
    position = np.array(position_px, dtype=float)
    missing = np.isnan(position).any(axis=2)  # (n, m)
    position[missing] = np.nan
    belief = np.where(np.isnan(confidence), 1.0, confidence)
    belief = np.where(missing, 0.0, belief)
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
    faults.raise_if_any()
    return as_tracks(tuple(markers), np.array(time_s, dtype=float), position, belief)


def save_fishsim(path: Path, tracks: xr.Dataset) -> None:
    """Writes the authors' form, nan where missing, whole or not at all; `session.tracks.load_tracks` reads it.

    Times and confidences are lost.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    rows = pixels_of(tracks).reshape(len(tracks.time.values), -1).tolist()  # (n, 2 m)
    write_whole(path, "".join(",".join(map(repr, row)) + "\n" for row in rows))
