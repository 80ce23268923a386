"""A page that lists the reports of several sessions with their key numbers."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from fitting import CalibrationResult
from fitting.ebt import EBT_RATIO_ONLY
from reports.numbers import MISSING, counted, in_mm, listed, shown
from reports.page import render_page
from session import Flag
from session.flags import FLAG_KINDS
from session.results import write_whole


@dataclass(frozen=True)
class IndexEntry:
    """One session in the index.

    Attributes:
        name: of the session.
        report: its report.
        trials: how many were fitted and how many held out.
        frequency_hz: slowest and fastest trial; None where unknown.
        marker_error_mm: mean over the fit and over the held-out trials; None where unknown.
        speed_mae: of the twin and of elongated body theory over the held-out trials, m/s; None where unknown.
        flags: of the fit as a whole.
    """

    name: str
    report: Path
    trials: tuple[int, int]
    frequency_hz: tuple[float, float] | None
    marker_error_mm: tuple[float | None, float | None]
    speed_mae: tuple[float | None, float | None]
    flags: tuple[Flag, ...] = ()

    @classmethod
    def from_calibration(cls, name: str, report: Path, found: CalibrationResult) -> "IndexEntry":
        """The key numbers of a calibration."""
        roles = [trial.role for trial in found.trials.values()]
        hz = [trial.frequency_hz for trial in found.trials.values()]
        fit, holdout = found.summary["fit"], found.summary["holdout"]
        return cls(
            name=name,
            report=report,
            trials=(roles.count("fit"), roles.count("holdout")),
            frequency_hz=(min(hz), max(hz)) if hz else None,
            marker_error_mm=(
                None if fit is None else fit.marker_error_mm,
                None if holdout is None else holdout.marker_error_mm,
            ),
            speed_mae=(None, None) if holdout is None else (holdout.speed_mae_twin, holdout.speed_mae_ebt),
            flags=found.flags,
        )


def write_index(path: Path, entries: Sequence[IndexEntry]) -> None:
    """Writes the index, whole or not at all, with links relative to it.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    write_whole(path, render_index(entries, path.parent))


def render_index(entries: Sequence[IndexEntry], folder: Path) -> str:
    """The index as HTML.

    Args:
        entries: in the order they are listed.
        folder: where the page will be, for its links.
    """
    fitted, held_out = (sum(entry.trials[role] for entry in entries) for role in (0, 1))
    return render_page(
        "index.html.j2",
        title="Calibrated sessions",
        summary=(
            f"{counted(len(entries), 'session')}, {fitted + held_out} trials: {fitted} fitted, {held_out} held out"
        ),
        entries=[
            {
                "href": _href(entry.report, folder),
                "name": entry.name,
                "numbers": _numbers(entry),
                "mind": _mind(entry),
            }
            for entry in entries
        ],
    )


def _href(report: Path, folder: Path) -> str:
    """A relative link that works after both have moved together; absolute where they share no root."""
    try:
        return quote(Path(os.path.relpath(report, folder)).as_posix())
    except ValueError:  # another drive on Windows
        return report.absolute().as_uri()


def _numbers(entry: IndexEntry) -> tuple[str, ...]:
    fit, holdout = entry.trials
    hz = entry.frequency_hz
    return (
        f"{fit} + {holdout}",
        MISSING if hz is None else f"{shown(hz[0], 2)} to {shown(hz[1], 2)}",
        *(shown(error) for error in entry.marker_error_mm),
        *(in_mm(error) for error in entry.speed_mae),
    )


def _mind(entry: IndexEntry) -> str:
    """Flags of the fit by kind; that EBT's numbers are not both identifiable is so in every session."""
    kinds = dict.fromkeys(flag.kind for flag in entry.flags if flag.kind != EBT_RATIO_ONLY)
    return listed([FLAG_KINDS.get(kind, kind.replace("_", " ")) for kind in kinds]) or MISSING
