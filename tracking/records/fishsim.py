"""The authors' CSV: no header, x0,y0,x1,y1,… in pixels, one row a frame, in the order of the markers."""

from __future__ import annotations

from pathlib import Path

from session import Tracks, write_whole


def save_fishsim(path: Path, tracks: Tracks) -> None:
    """Writes the authors' form, nan where missing, whole or not at all; `session.load_tracks` reads it.

    Times and confidences are lost.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    rows = tracks.position_px.reshape(len(tracks.time_s), -1).tolist()  # (n, 2 m)
    write_whole(path, "".join(",".join(map(repr, row)) + "\n" for row in rows))
