"""`results/report.html`: one self-contained page a session."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fitting import Calibration, Evidence, SearchRun
from reports.context import ReportContext
from reports.numbers import counted
from reports.page import render_page
from reports.sections import SECTIONS
from session import Provenance, Session, write_whole

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings


def write_report(
    path: Path,
    session: Session,
    calibration: Calibration,
    provenance: Provenance,
    notes: Sequence[str] = (),
    evidence: Evidence | None = None,
    searches: Sequence[SearchRun] = (),
    posterior: Findings | None = None,
) -> None:
    """Writes the report of one session, whole or not at all.

    Args:
        path: usually `results/report.html` of the session.
        session: as described in its folder.
        calibration: the calibrated twin beside every trial.
        provenance: what it was made with.
        notes: further sentences for the reader, such as which trials were left out and why.
        evidence: what stands beside the fit; None where it was not worked out.
        searches: the searches compared, empty where they were not.
        posterior: how sure the coefficients are; None where it was not sampled.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    write_whole(path, render_report(session, calibration, provenance, notes, evidence, searches, posterior))


def render_report(
    session: Session,
    calibration: Calibration,
    provenance: Provenance,
    notes: Sequence[str] = (),
    evidence: Evidence | None = None,
    searches: Sequence[SearchRun] = (),
    posterior: Findings | None = None,
) -> str:
    """The report as HTML: opens offline, holds its figures, and loads nothing."""
    context = ReportContext(session, calibration, provenance, tuple(notes), evidence, tuple(searches), posterior)
    built = [build(context) for build in SECTIONS]
    trials = counted(len(calibration.trials), "trial")
    return render_page(
        "report.html.j2",
        title=f"{session.name} – swimcal report",
        session=session.name,
        byline=f"{calibration.robot.name}, {trials} · {provenance.program}, MuJoCo {provenance.mujoco}, "
        f"effort {provenance.effort}, seed {provenance.seed}",
        sections=[section for section in built if section is not None],
    )
