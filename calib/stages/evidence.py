"""What stands beside a fit: ``results/evidence.json``."""

from dataclasses import replace

from calib.job import Job
from calib.stages.fit import FitStage
from fitting import Calibration, MeasuredTrial
from fitting.evidence import EVIDENCE, Evidence, gather_evidence
from session.stage import Stage
from swimmer import Twin


class EvidenceStage(Stage):
    """Boxes put right, profiles of the coefficients, and with full effort other pairs of fit trials.

    Args:
        job: the work on the session.
        fit: that it stands beside.
    """

    def __init__(self, job: Job, fit: FitStage) -> None:
        self._job, self._fit = job, fit
        super().__init__(job.results / EVIDENCE.name, {}, {}, [fit])

    def make(self, calibration: Calibration, trials: list[MeasuredTrial], twin: Twin) -> None:
        """Gathers and writes it."""
        job, pairs = self._job, self._fit.effort == "full"
        evidence = gather_evidence(trials, twin, calibration.fit, pairs, job.session.seed, job.tell)
        written = EVIDENCE.write(job.results, replace(job.provenance, effort=self._fit.effort), evidence)
        self.mark(written)
        job.made.extend(written)

    def read(self) -> Evidence | None:
        """The evidence that stands beside this fit; None where there is none."""
        return EVIDENCE.read(self._job.results) if self.is_current else None
