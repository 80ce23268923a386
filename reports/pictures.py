"""The figures of a diagnosis as files, for a talk or a page: `python -m reports.pictures SESSION FOLDER`."""

import argparse
import sys
from pathlib import Path

from reports.diagnosed import read_diagnosed
from reports.sections.gap_plots import gap_plots
from session import SwimcalError, load_session
from session.results import write_whole
from swimmer import load_robot

_DOTS_PER_INCH = 160.0


def write_pictures(folder: Path, out: Path) -> tuple[Path, ...]:
    """Writes a PNG for each figure of a session's diagnosis, and tells where.

    Args:
        folder: of the session, which was diagnosed.
        out: folder for the pictures.

    Raises:
        InputError: there is no session, or it was not diagnosed.
        ResultsNotWritable: they cannot be written.
    """
    found = read_diagnosed(folder / "results")
    session = load_session(folder)
    plots = gap_plots(found, load_robot(session.robot_file), session.markers)
    written = {out / f"{name}.png": plot for name, plot in plots.items()}
    for path, plot in written.items():
        write_whole(path, plot.png(_DOTS_PER_INCH))
    return tuple(written)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("session", type=Path)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    try:
        for path in write_pictures(given.session, given.folder):
            print(path)
    except SwimcalError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
