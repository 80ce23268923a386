"""A page that lists the reports of several sessions with their key numbers."""

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from fitting import CalibrationResult
from fitting.ebt import EBT_RATIO_ONLY
from reports.numbers import MISSING, counted, in_mm, listed, shown
from reports.page import render_page
from session.flags import FLAG_KINDS
from session.results import write_whole

Entry = tuple[str, Path, CalibrationResult]
"""The name of a session, its report and its calibration."""


def write_index(path: Path, entries: Sequence[Entry]) -> None:
    """Writes the index, whole or not at all, with links relative to it.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    roles = [trial.role for _, _, found in entries for trial in found.trials.values()]
    fitted, held_out = roles.count("fit"), roles.count("holdout")
    page = render_page(
        "index.html.j2",
        title="Calibrated sessions",
        summary=(
            f"{counted(len(entries), 'session')}, {fitted + held_out} trials: {fitted} fitted, {held_out} held out"
        ),
        entries=[
            {"href": _href(report, path.parent), "name": name, "numbers": _numbers(found), "caveats": _caveats(found)}
            for name, report, found in entries
        ],
    )
    write_whole(path, page)


def _href(report: Path, folder: Path) -> str:
    """A relative link that works after both have moved together; absolute where they share no root."""
    try:
        return quote(Path(os.path.relpath(report, folder)).as_posix())
    except ValueError:  # another drive on Windows
        return report.absolute().as_uri()


def _numbers(found: CalibrationResult) -> tuple[str, ...]:
    """Trials fitted and held out, slowest and fastest, mean marker errors of both, speed errors of those held out."""
    roles = [trial.role for trial in found.trials.values()]
    hz = [trial.frequency_hz for trial in found.trials.values()]
    fit, holdout = found.summary["fit"], found.summary["holdout"]
    return (
        f"{roles.count('fit')} + {roles.count('holdout')}",
        f"{shown(min(hz), 2)} to {shown(max(hz), 2)}" if hz else MISSING,
        *(shown(None if part is None else part.marker_error_mm) for part in (fit, holdout)),
        in_mm(None if holdout is None else holdout.speed_mae_twin),
        in_mm(None if holdout is None else holdout.speed_mae_ebt),
    )


def _caveats(found: CalibrationResult) -> str:
    """Flags of the fit by kind; that EBT's numbers are not both identifiable is so in every session."""
    kinds = dict.fromkeys(flag.kind for flag in found.flags if flag.kind != EBT_RATIO_ONLY)
    return listed([FLAG_KINDS.get(kind, kind.replace("_", " ")) for kind in kinds]) or MISSING
