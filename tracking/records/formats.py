"""Tracks in the forms of other programs: recognised by content on the way in, named on the way out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import xarray as xr

from session.tables import read_table
from session.tracks import load_tracks, save_tracks
from tracking.records.deeplabcut import is_deeplabcut, load_deeplabcut, save_deeplabcut
from tracking.records.foreign import save_fishsim
from tracking.records.movement import load_movement, save_movement

SIGNATURES = (b"\x89HDF\r\n\x1a\n", b"CDF")
"""How files of netCDF start: version 4, which is HDF5, and 3."""
FORMATS: dict[str, Callable[[Path, xr.Dataset], None]] = {
    "swimcal": save_tracks,
    "deeplabcut": save_deeplabcut,
    "movement": save_movement,
    "fishsim": save_fishsim,
}
"""The forms that tracks can be written in, by name: the contract's CSV, DeepLabCut's CSV, netCDF as of the package
`movement`, the authors' CSV without a header."""


def import_tracks(path: Path, markers: Sequence[str], fps: float) -> xr.Dataset:
    """Reads tracks in any of the forms in `FORMATS`, which is recognised by the content, not by the name.

    Text may be packed (.gz); `fps` is for forms without time. What the file tracks beyond the `markers` is left out,
    save in our own form, in which it is an error.

    Raises:
        InputError: every fault of the file at once.
    """
    if _is_netcdf(path):
        return load_movement(path, markers, fps)
    if is_deeplabcut(read_table(path)):
        return load_deeplabcut(path, markers, fps)
    return load_tracks(path, markers, fps)


def export_tracks(tracked: xr.Dataset, path: Path, form: str) -> None:
    """Writes tracks in a form of `FORMATS`, whole or not at all.

    States and sizes are kept by ``movement`` alone, times by ``swimcal`` and ``movement``, confidences by all but
    ``fishsim``.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    FORMATS[form](path, tracked)


def _is_netcdf(path: Path) -> bool:
    """No as well for what cannot be read, which readers report."""
    try:
        with path.open("rb") as stream:
            return stream.read(8).startswith(SIGNATURES)
    except OSError:
        return False
