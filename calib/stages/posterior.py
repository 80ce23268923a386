"""The stage from a calibration to its uncertainty: draws from the posterior, and their summary.

emcee and ArviZ take a second to load: they are imported where they are needed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_limits

from calib.options import EffortName, Job
from calib.stages.fit import FitStage
from fitting.calibration import Calibration
from fitting.mode import Mode, SessionModel, mode_at
from fitting.search import part_of
from fitting.structure import uncertainties_of
from fitting.trial import MeasuredTrial
from swimcal.errors import NotConverged
from swimcal.results import writing_whole
from swimcal.stage import Stage
from swimcal.twin import Twin

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary

EFFECTIVE = {"quick": 100, "full": 400}
"""Number of effective draws of every coefficient, by effort."""

_FORM = 11  # version of the files and of the computation


class PosteriorStage(Stage):
    """The stage of ``results/posterior.nc`` and ``posterior.json``, and of `posterior` in ``calibration.json``."""

    def __init__(self, job: Job, fit: FitStage, effort: EffortName) -> None:
        self._job, self._fit, self.effort = job, fit, effort
        file = job.results / "posterior.nc"
        super().__init__(file, {}, {"form": _FORM, "effort": self.effort}, [fit])

    @property
    def summary_file(self) -> Path:
        """The path of ``results/posterior.json``, the summary."""
        return self.file.with_suffix(".json")

    @threadpool_limits.wrap(limits=1, user_api="blas")  # several threads round sums differently, and so the bands
    def make(self, calibration: Calibration, trials: list[MeasuredTrial], twin: Twin) -> None:
        """Sample the posterior about a calibration and write it.

        Args:
            calibration: the calibration.
            trials: the trials that take part in it.
            twin: the twin of the calibrated robot.

        Raises:
            NotConverged: too few effective draws, or chains that disagree; nothing is written.
        """
        from fitting.posterior.posterior import sample_posterior, save_draws
        from fitting.posterior.summary import SUMMARY, summarise

        job = self._job
        job.progress("building the model about the fit", 0.0)
        mode = mode_of(calibration, trials, twin)
        tell = part_of(job.progress, 0.1, 0.6)
        posterior = sample_posterior(mode, EFFECTIVE[self.effort], job.session.seed, tell)
        if posterior.draws.flags:
            why = posterior.draws.flags[0].message
            raise NotConverged(
                f"{self.file}: not written, nor are intervals reported; found: {why}. Look into the flags of the fit "
                "trials, leave out faulty ones, or try another [fit] seed in session.toml."
            )
        summary = summarise(posterior, trials, job.session.seed, part_of(job.progress, 0.6, 1.0))
        provenance = replace(job.provenance, effort=self.effort)
        stamp = {key: value for key, value in provenance.to_json().items() if isinstance(value, str | int)}
        job.note_incomplete(self.incomplete)
        if (kept := self.keep_aside()) is not None:
            job.notes.append(f"The previous posterior is kept in {kept}.")
        with writing_whole(self.file) as part:
            save_draws(part, posterior, stamp)
        written = (self.file, *SUMMARY.write(job.results, provenance, summary))
        self._fit.add_posterior(posterior.marginals)
        self.mark(written)
        job.made.extend(written)

    def read(self, draws: bool = True) -> PosteriorSummary | None:
        """Read the summary of the posterior of this calibration, with its draws or without.

        None where there is none.
        """
        from fitting.posterior.summary import read_summary

        return read_summary(self._job.results, draws) if self.is_current else None


def mode_of(calibration: Calibration, trials: Iterable[MeasuredTrial], twin: Twin) -> Mode:
    """Rebuild the mode that a calibration keeps, where it lies, without a search.

    Args:
        calibration: the calibration.
        trials: the trials that take part in it.
        twin: the twin of the calibrated robot.
    """
    fitted = sorted((trial for trial in trials if trial.role == "fit"), key=lambda trial: trial.name)
    model = SessionModel.of(twin, fitted, uncertainties_of(calibration.structure.sources), with_course=True)
    fit = calibration.fit
    return mode_at(model, np.array(fit.coefficients), fit.components, fit.roll, fit.ends)
