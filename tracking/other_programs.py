"""Files of other programs, recognised by their content: which cannot be read, and the way that works.

`check_readable` refuses them with the name of the program, so that nobody has to guess from faults of a table.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal, NamedTuple

from swimcal.errors import Fault, InputError

HDF5 = b"\x89HDF\r\n\x1a\n"
NETCDF_3 = b"CDF"
Engine = Literal["h5netcdf", "scipy"]
"""Engines of xarray: for netCDF 4, which is HDF5, and for netCDF 3."""
OWN_CSV = "a CSV with the columns time_s,nose_x,nose_y,… in pixels"

_SLEAP = "Export the tracks: in SLEAP File > Export Analysis CSV; or load them with `movement` and save netCDF."
_SHEET = f"Save the sheet as CSV: {OWN_CSV}."


class _Program(NamedTuple):
    """One kind of file of another program, and how to bring its tracks here."""

    what: str
    step: str


SLEAP_PROJECT = _Program("this is a project of SLEAP (.slp)", _SLEAP)
SLEAP_ANALYSIS = _Program("this is SLEAP's analysis in HDF5", _SLEAP)
DEEPLABCUT_H5 = _Program(
    "this is DeepLabCut's HDF5",
    "Give the CSV beside it (`deeplabcut.analyze_videos(…, save_as_csv=True)`), or save it with `movement` as netCDF.",
)
C3D = _Program(
    "this is C3D, places of motion capture in space",
    f"Export two coordinates of the plane of the water as CSV: {OWN_CSV}; or give the video.",
)
_BINARY = (
    (re.compile(rb"PK\x03\x04"), _Program("this is a workbook of Excel, or another zip file", _SHEET)),
    (re.compile(rb"\xd0\xcf\x11\xe0"), _Program("this is a workbook of Excel (.xls)", _SHEET)),
    (re.compile(rb"MATLAB "), _Program("this is a MAT file of MATLAB", f"Write it with writetable as {OWN_CSV}.")),
    (re.compile(rb"\x93NUMPY"), _Program("this is an array of NumPy", f"Write it as {OWN_CSV}.")),
    (re.compile(rb"\x80[\x02-\x05]"), _Program("this is a pickle of Python", f"Write the tracks as {OWN_CSV}.")),
    (re.compile(rb"PAR1"), _Program("this is a Parquet file", f"Write it with `to_csv` as {OWN_CSV}.")),
    (
        re.compile(rb"....ftyp|RIFF....AVI |\x1aE\xdf\xa3", re.DOTALL),
        _Program("this is a video, not tracks", "Give it with --videos."),
    ),
)
_TEXT = (
    (
        re.compile(r"opensourcephysics|^#?multi:", re.IGNORECASE),
        _Program(
            "this is a file of Tracker (Open Source Physics)",
            f"Export each point's x and y in pixels (File > Export > Data File) and write them as {OWN_CSV}.",
        ),
    ),
    (
        re.compile(r"<KinoveaVideoAnalysis|kinovea", re.IGNORECASE),
        _Program("this is a file of Kinovea", f"Export the trajectories in pixels, and write them as {OWN_CSV}."),
    ),
    (
        re.compile(r"^PathFileType|^NO_OF_FRAMES\t|^Format Version,"),
        _Program(
            "this is an export of motion capture (TRC, TSV or CSV)", f"Write the plane of the water as {OWN_CSV}."
        ),
    ),
    (
        re.compile(r"\bTRACK_ID,.*\bPOSITION_X\b|^Label,Spot ID,Track ID", re.IGNORECASE),
        _Program("this is TrackMate's table of spots, a row for each spot", f"Write a row for each frame: {OWN_CSV}."),
    ),
    (
        re.compile(r"^\W*Number of header lines", re.IGNORECASE),
        _Program("this is an export of EthoVision", f"Write x and y of each point in pixels as {OWN_CSV}."),
    ),
    (
        re.compile(r"^%?time,.*\bfield\.", re.IGNORECASE),
        _Program("this is a topic of ROS", f"Write time, x and y of each marker as {OWN_CSV}."),
    ),
    (re.compile(r"^\s*<\?xml|^\s*<[A-Za-z]"), _Program("this is XML, not tracks", f"Export {OWN_CSV}.")),
    (re.compile(r"^\s*[\[{]"), _Program("this is JSON, not tracks", f"Write the tracks as {OWN_CSV}.")),
)


def check_readable(path: Path) -> Engine | None:
    """Check that a file may be tracks in a readable form; files that cannot be opened are left to the readers.

    Returns:
        The engine that reads it, of a file of netCDF.

    Raises:
        InputError: it is another program's file; the message says whose, and the way that works.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(2048)
    except OSError:
        return None
    program = _hdf5(path) if head.startswith(HDF5) else _other(head)
    if program is not None:
        expected = "tracks as CSV (ours, DeepLabCut's, SLEAP's) or netCDF of movement"
        raise InputError([Fault(str(path), "", program.what, "", expected, next_step=program.step)])
    return "h5netcdf" if head.startswith(HDF5) else "scipy" if head.startswith(NETCDF_3) else None


def _other(head: bytes) -> _Program | None:
    if len(head) >= 512 and head[1] == 0x50 and head[0] in range(2, 64) and b"\x00" in head[:12]:
        return C3D  # the second byte is 80 in every C3D file: https://www.c3d.org/docs/C3D_User_Guide.pdf
    for pattern, program in _BINARY:
        if pattern.match(head):
            return program
    text = head.decode("utf-8-sig", errors="ignore")
    return next((program for pattern, program in _TEXT if pattern.search(text)), None)


def _hdf5(path: Path) -> _Program | None:
    """Identify the program that wrote an HDF5 file; None for `movement`."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            names = set(file)
            groups = [file[name] for name in names]
            tables = any(isinstance(group, h5py.Group) and "table" in group for group in groups)
    except (OSError, RuntimeError, KeyError):
        return None
    if names & {"pred_points", "instances", "tracks_json"}:
        return SLEAP_PROJECT
    if names & {"track_occupancy", "node_names"}:
        return SLEAP_ANALYSIS
    return DEEPLABCUT_H5 if tables else None
