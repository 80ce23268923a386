"""What every section of a report may read."""

from dataclasses import dataclass

from fitting import CalibratedTrial, Calibration, Evidence, SearchRun
from session import Provenance, Session


@dataclass(frozen=True, eq=False)
class ReportContext:
    """The results of one session.

    Attributes:
        session: as described in its folder.
        calibration: the calibrated twin beside every trial.
        provenance: what it was made with.
        notes: further sentences for the reader, such as what was left out.
        evidence: what stands beside the fit; None where it was not worked out.
        searches: the searches compared on this session; empty where they were not.
    """

    session: Session
    calibration: Calibration
    provenance: Provenance
    notes: tuple[str, ...] = ()
    evidence: Evidence | None = None
    searches: tuple[SearchRun, ...] = ()

    def trials(self, role: str) -> tuple[CalibratedTrial, ...]:
        """The fit or the held-out trials, in the order of the session."""
        return tuple(trial for trial in self.calibration.trials if trial.measured.role == role)
