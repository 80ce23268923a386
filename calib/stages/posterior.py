"""From a calibration to how sure it is: draws from the posterior, and what they say.

emcee and ArviZ take a second to load: they are imported where they are needed.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calib.options import EffortName, Job
from calib.stages.fit import FitStage
from fitting import Calibration, MeasuredTrial
from session.errors import NotConverged
from session.results import writing_whole
from session.stage import Stage
from swimmer import Twin
from swimmer.effects import catalogue

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings

EFFECTIVE = {"quick": 100, "full": 400}
"""Effective draws of every coefficient."""

_FORM = 7  # of the files and of what they rest on


class PosteriorStage(Stage):
    """``results/posterior.nc`` and ``posterior.json``, and `posterior` in ``calibration.json``.

    Args:
        job: the work on the session.
        fit: the calibration that it belongs to.
        effort: of the sampling; default: as the options have it.
    """

    def __init__(self, job: Job, fit: FitStage, effort: EffortName | None = None) -> None:
        self._job, self._fit, self.effort = job, fit, effort or job.options.effort
        file = job.results / "posterior.nc"
        effects = {name: [list(parameter) for parameter in effect.parameters] for name, effect in catalogue().items()}
        self._drawn = Stage(file, {}, {"form": _FORM, "effort": self.effort}, [fit])  # whatever is said of it
        super().__init__(file, {}, {"effects": effects}, [self._drawn])

    @property
    def findings_file(self) -> Path:
        """``results/posterior.json``: what is said of it."""
        return self.file.with_suffix(".json")

    def make(self, calibration: Calibration, trials: list[MeasuredTrial], twin: Twin) -> None:
        """Samples the posterior given the fit trials and writes it; sampling that was stopped goes on.

        Args:
            calibration: its coefficients are looked at first.
            trials: all swims.
            twin: with their markers.

        Raises:
            NotConverged: too few effective draws, or chains that disagree; nothing is written but the chain.
        """
        from fitting.model.robot_doubt import doubts_of
        from fitting.posterior import sample_posterior
        from fitting.posterior.findings import FINDINGS, find
        from fitting.posterior.posterior_file import save_draws
        from fitting.signatures.score_tests import score_tests

        job, chain = self._job, self._chain()
        starts = [calibration.coefficients, *(end.coefficients for end in calibration.fit.ends)]
        posterior = sample_posterior(
            [trial for trial in trials if trial.role == "fit"],
            twin,
            np.array(starts, float),
            EFFECTIVE[self.effort],
            job.session.seed,
            chain,
            job.tell,
            doubts_of(calibration.structure.sources),
        )
        if not posterior.draws.enough:
            raise NotConverged(self._refusal(posterior.draws.flags[0].message, chain))
        left_out = score_tests(posterior, job.session.camera, catalogue().values(), job.tell)
        findings = find(posterior, trials, twin, job.session.seed, job.tell, left_out)
        provenance = replace(job.provenance, effort=self.effort)
        stamp = {key: value for key, value in provenance.to_json().items() if isinstance(value, str | int)}
        with writing_whole(self.file) as part:
            save_draws(part, posterior, stamp)
        written = (self.file, *FINDINGS.write(job.results, provenance, findings))
        self._fit.add_posterior(posterior.marginals)
        self.mark(written)
        self._forget(chain)
        job.made.extend(written)

    def read(self) -> Findings | None:
        """What is said of the posterior of this calibration; None where there is none."""
        from fitting.posterior.findings import read_findings

        return read_findings(self._job.results) if self.is_current else None

    @property
    def doubts(self) -> tuple[str, ...]:
        """When not to believe it, a sentence each; that a coefficient is not determined stands beside its interval."""
        found = self.read()
        return () if found is None else tuple(flag.message for flag in found.flags if flag.kind != "unidentifiable")

    def _refusal(self, why: str, chain: Path) -> str:
        return (
            f"{self.file}: not written, nor are intervals reported; found: {why}. The chain is kept in {chain}. "
            "Look into the flags of the fit trials, leave out faulty ones, try another [fit] seed in session.toml, or "
            "delete the chain to sample anew, and with the .npz beside it to search anew."
        )

    def _chain(self) -> Path:
        """Where every step is kept while sampling; one that cannot be read begins anew."""
        path = self._job.results / f".posterior-{self._drawn.fingerprint[:12]}.h5"
        if path.exists() and not _readable(path):
            path.unlink()  # the search that it began with still stands
        return path

    @staticmethod
    def _forget(chain: Path) -> None:
        """A chain, and the search that it began with."""
        for path in (chain, chain.with_suffix(".npz")):
            path.unlink(missing_ok=True)


def _readable(chain: Path) -> bool:
    """Whether a chain survived the way it was stopped."""
    from emcee.backends import HDFBackend

    with suppress(OSError, KeyError, AttributeError):
        return HDFBackend(str(chain), name="posterior", read_only=True).iteration >= 0
    return False
