"""The stage of ``results/report.html`` of a session, from the current results."""

from collections.abc import Mapping
from dataclasses import replace

from calib.options import Job
from calib.stages.diagnosis import DiagnosisStage
from calib.stages.fit import FitStage, PublishedStage
from calib.stages.posterior import PosteriorStage
from fitting.calibration import Calibration
from reports.context import ReportContext, read_swims, swims_files
from reports.report import write_report
from swimcal.results import sha256_of
from swimcal.stage import Stage


class ReportStage(Stage):
    """The report of a fit, with its posterior and the diagnosis where they are current, and policies where trained."""

    def __init__(
        self,
        job: Job,
        fit: FitStage,
        published: PublishedStage | None,
        posterior: PosteriorStage | None,
        diagnosis: DiagnosisStage | None,
    ) -> None:
        inputs = {}
        if published is not None:
            inputs["published"] = sha256_of(published.file)
        if posterior is not None:
            inputs["posterior"] = sha256_of(posterior.summary_file)
        if diagnosis is not None:
            inputs["diagnosis"] = sha256_of(diagnosis.file)
        inputs |= {file.name: sha256_of(file) for file in swims_files(job.results)}
        super().__init__(job.results / "report.html", inputs, {}, [fit])
        self._fit = fit
        self._job, self._published, self._posterior, self._diagnosis = job, published, posterior, diagnosis

    def make(self, calibration: Calibration, notes: tuple[str, ...], damaged: Mapping[str, str]) -> None:
        """Write the report, with notes for the reader and the file of each result that cannot be read.

        Args:
            calibration: the calibration to report on.
            notes: sentences for the reader, such as what was left out.
            damaged: the file of "posterior" or "diagnosis" that cannot be read, where there is one.
        """
        job = self._job
        job.progress("writing the report")
        context = ReportContext(
            job.session,
            calibration,
            replace(job.provenance, effort=self._fit.effort),
            notes,
            published=None if self._published is None else self._published.read(),
            posterior=None if self._posterior is None else self._posterior.read(),
            diagnosed=None if self._diagnosis is None else self._diagnosis.read(),
            diagnosis_effort="" if self._diagnosis is None else self._diagnosis.effort,
            policies=read_swims(job.results),
            damaged=damaged,
        )
        write_report(self.file, context)
        self.mark()
        job.made.append(self.file)
