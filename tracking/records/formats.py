"""Tracks in the forms of other programs: recognised by content on the way in, named on the way out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import xarray as xr

from session import FaultCollector
from session.tracks import NO_NAMES, save_tracks
from tracking.records.deeplabcut import is_deeplabcut, read_deeplabcut, save_deeplabcut
from tracking.records.foreign import ForeignTracks, save_fishsim
from tracking.records.foreign_table import read_foreign_table
from tracking.records.movement import Engine, read_movement, save_movement
from tracking.records.plain_csv import read_headerless, read_plain
from tracking.records.signatures import HDF5, NETCDF_3, check_readable

FORMATS: dict[str, Callable[[Path, xr.Dataset], None]] = {
    "swimcal": save_tracks,
    "deeplabcut": save_deeplabcut,
    "movement": save_movement,
    "fishsim": save_fishsim,
}
"""The forms that tracks can be written in, by name: the contract's CSV, DeepLabCut's CSV, netCDF as of the package
`movement`, the authors' CSV without a header."""


def read_foreign(path: Path, markers: Sequence[str]) -> ForeignTracks:
    """Read all that a file tracks, in any of the forms in `FORMATS` or SLEAP's CSV, recognised by the content.

    Args:
        path: the file; text may be packed (.gz).
        markers: names for rows without names, in their order.

    Raises:
        InputError: every fault of the file at once; of another program's file, what it is and the way that works.
    """
    check_readable(path)
    if (engine := _netcdf(path)) is not None:
        return read_movement(path, engine)
    table = read_foreign_table(path)
    if is_deeplabcut(table):
        return read_deeplabcut(table)
    return read_headerless(table, tuple(markers)) if table.header is None else read_plain(table)


def import_tracks(
    path: Path, markers: Sequence[str], fps: float | None = None, rename: Mapping[str, str] = NO_NAMES
) -> xr.Dataset:
    """Read the tracks of the named markers with `read_foreign`; other tracks of the file are dropped.

    Args:
        path: the file.
        markers: our names of the markers.
        fps: frame rate, for forms without time.
        rename: from the file's names to ours.

    Raises:
        InputError: every fault of the file at once.
    """
    found = read_foreign(path, markers)
    return found.tracks(markers, fps, FaultCollector(str(path)), rename).assign_attrs(source=str(path))


def export_tracks(tracked: xr.Dataset, path: Path, form: str) -> None:
    """Write tracks in a form of `FORMATS`, whole or not at all.

    States and sizes are kept by ``movement`` alone, times by ``swimcal`` and ``movement``, confidences by all but
    ``fishsim``.

    Args:
        tracked: the tracks.
        path: the file to write.
        form: a key of `FORMATS`.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    FORMATS[form](path, tracked)


def _netcdf(path: Path) -> Engine | None:
    """Choose the engine that reads a file of netCDF; None for other files and unreadable ones."""
    try:
        with path.open("rb") as stream:
            head = stream.read(8)
    except OSError:
        return None
    return "h5netcdf" if head.startswith(HDF5) else "scipy" if head.startswith(NETCDF_3) else None
