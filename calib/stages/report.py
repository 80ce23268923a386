"""``results/report.html`` of a session, from the results that stand."""

from calib.job import Job
from calib.stages.diagnosis import DiagnosisStage
from calib.stages.fit import FitStage
from calib.stages.posterior import PosteriorStage
from fitting import EVIDENCE, Calibration, Evidence
from reports import ReportContext, read_diagnosed, write_report
from session import Stage, sha256_of


class ReportStage(Stage):
    """The report of a fit, with its posterior and the diagnosis where they stand.

    Args:
        job: the work on the session.
        fit: that it reports.
        posterior: of the fit; shown where it is current.
        diagnosis: shown where there is one.
    """

    def __init__(self, job: Job, fit: FitStage, posterior: PosteriorStage, diagnosis: DiagnosisStage | None) -> None:
        inputs = {}
        if posterior.is_current:
            inputs["posterior"] = sha256_of(posterior.findings_file)
        if diagnosis is not None:
            inputs["diagnosis"] = sha256_of(diagnosis.file)
        super().__init__(job.results / "report.html", inputs, {}, [fit])
        self._job, self._posterior, self._diagnosis = job, posterior, diagnosis

    def make(self, calibration: Calibration, evidence: Evidence, notes: tuple[str, ...]) -> None:
        """Writes the report.

        Args:
            calibration: of the fit.
            evidence: what stands beside it.
            notes: further sentences for the reader.

        Raises:
            ResultsNotWritable: it cannot be written.
        """
        job = self._job
        job.tell("writing the report")
        context = ReportContext(
            job.session,
            calibration,
            job.provenance,
            notes,
            evidence=evidence,
            posterior=self._posterior.read(),
            diagnosed=None if self._diagnosis is None else read_diagnosed(job.results),
        )
        write_report(self.file, context)
        self.mark([job.results / EVIDENCE.name])
        job.made.append(self.file)
