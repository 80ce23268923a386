"""The figures of a diagnosis as files, for a talk or a page: `python -m reports.pictures SESSION FOLDER`."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure

from reports.diagnosed import Diagnosed, read_diagnosed
from reports.figures import (
    gap_effects_figure,
    gap_fish_figure,
    gap_forces_figure,
    gap_held_out_figure,
    gap_separation_figure,
    gap_shares_figure,
    gap_slides_figure,
    gap_waterfall_figure,
)
from reports.figures.gap_separation import told_apart
from reports.figures.gap_slides import slides
from reports.png import png_of
from session import Session, SwimcalError, load_session, write_whole
from swimmer import load_robot

_DOTS_PER_INCH = 160.0


def write_pictures(session: Path, folder: Path) -> tuple[Path, ...]:
    """Writes a PNG for each figure of a session's diagnosis, and tells where.

    Args:
        session: folder, which was diagnosed.
        folder: for the pictures.

    Raises:
        InputError: there is no session, or it was not diagnosed.
        ResultsNotWritable: they cannot be written.
    """
    results = session / "results"
    found = read_diagnosed(results)
    written = []
    for name, figure in _figures(found, load_session(session)):
        written.append(folder / f"{name}.png")
        write_whole(written[-1], png_of(figure, _DOTS_PER_INCH))
    return tuple(written)


def _figures(found: Diagnosed, session: Session) -> Iterator[tuple[str, Figure]]:
    """As the report has them, where there is something to see."""
    yield "gap-fish", gap_fish_figure(found, load_robot(session.robot_file), session.markers)
    yield "gap-shares", gap_shares_figure(found)
    if slides(found):
        yield "gap-slides", gap_slides_figure(found)
    yield "gap-effects", gap_effects_figure(found)
    if found.held_out:
        yield "gap-waterfall", gap_waterfall_figure(found)
        yield "gap-held-out", gap_held_out_figure(found.data.gap, bool(found.refitted))
    if found.everything is not None:
        yield "gap-everything", gap_held_out_figure(found.everything.gap, True)
    if len(told_apart(found)[0]) > 1:
        yield "gap-separation", gap_separation_figure(found)
    yield "gap-forces", gap_forces_figure(found.data.missing_forces)


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
