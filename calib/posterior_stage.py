"""From a calibration to how sure it is: draws from the posterior, and what they say.

emcee and ArviZ take a second to load: they are imported where they are needed.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calib.options import Options
from fitting import Calibration, MeasuredTrial
from session import (
    NotConverged,
    Provenance,
    Session,
    fingerprint_of,
    is_current,
    mark_current,
    read_result_json,
    write_result_json,
    writing_whole,
)
from swimmer import Twin
from swimmer.effects import catalogue

if TYPE_CHECKING:
    from fitting.posterior.findings import Findings

EFFECTIVE = {"quick": 100, "full": 400}
"""Effective draws of every coefficient."""

FORM = 6  # of the files and of what they rest on


class PosteriorStage:
    """``results/posterior.nc`` and ``posterior.json``, and `posterior` in ``calibration.json``.

    Args:
        session: as read.
        options: effort, progress.
        stamp: what results are stamped with.
        calibration: fingerprint of the calibration that it belongs to.
    """

    def __init__(self, session: Session, options: Options, stamp: Provenance, calibration: str) -> None:
        self._session, self._options, self._stamp, self._calibration = session, options, stamp, calibration

    @property
    def file(self) -> Path:
        """``results/posterior.nc``."""
        return self._session.results / "posterior.nc"

    @property
    def findings_file(self) -> Path:
        """``results/posterior.json``: what is said of it."""
        return self._session.results / "posterior.json"

    @cached_property
    def fingerprint(self) -> str:
        """Of the calibration, how draws are made, and the effects that are looked for."""
        effects = {name: [list(parameter) for parameter in effect.parameters] for name, effect in catalogue().items()}
        return fingerprint_of({}, {"effects": effects}, [self._drawn])

    @cached_property
    def _drawn(self) -> str:
        """Fingerprint of the calibration and how draws are made, whatever is said of them."""
        return fingerprint_of({}, {"form": FORM, "effort": self._options.effort}, [self._calibration])

    @property
    def is_current(self) -> bool:
        """Whether it belongs to the calibration."""
        return is_current(self.file, self.fingerprint)

    def make(self, calibration: Calibration, trials: list[MeasuredTrial], twin: Twin) -> list[Path]:
        """Samples the posterior given the fit trials and writes it; sampling that was stopped goes on.

        Args:
            calibration: its coefficients are looked at first.
            trials: all swims.
            twin: with their markers.

        Raises:
            NotConverged: too few effective draws, or chains that disagree; nothing is written but the chain.
        """
        from fitting.posterior import sample_posterior
        from fitting.posterior.findings import find
        from fitting.posterior.findings_file import findings_payload
        from fitting.posterior.posterior_file import marginals_payload, save_draws
        from fitting.posterior.robot_doubt import doubts_of
        from fitting.signatures.score_tests import score_tests

        chain = self._chain()
        starts = [calibration.coefficients, *(restart.coefficients for restart in calibration.fit.restarts)]
        posterior = sample_posterior(
            [trial for trial in trials if trial.role == "fit"],
            twin,
            np.array(starts, float),
            EFFECTIVE[self._options.effort],
            self._session.seed,
            chain,
            self._options.tell,
            doubts_of(calibration.structure.sources),
        )
        if not posterior.draws.enough:
            raise NotConverged(self._refusal(posterior.draws.flags[0].message, chain))
        left_out = score_tests(posterior, self._session.camera, catalogue().values(), self._options.tell)
        findings = find(posterior, trials, twin, self._session.seed, self._options.tell, left_out)
        stamp = {key: value for key, value in self._stamp.to_json().items() if isinstance(value, str | int)}
        with writing_whole(self.file) as part:
            save_draws(part, posterior, stamp)
        write_result_json(self.findings_file, self._stamp, findings_payload(findings))
        self._tell_calibration(marginals_payload(posterior))
        mark_current(self.file, self.fingerprint, [self.findings_file])
        self._forget(chain)
        return [self.file, self.findings_file]

    def read(self) -> Findings | None:
        """What is said of the posterior of this calibration; None where there is none."""
        from fitting.posterior.findings_file import read_findings

        return read_findings(read_result_json(self.findings_file), self.file) if self.is_current else None

    @property
    def doubts(self) -> tuple[str, ...]:
        """When not to believe it, a sentence each; that a coefficient is not determined stands beside its interval."""
        flags = read_result_json(self.findings_file)["flags"]
        return tuple(flag["message"] for flag in flags if flag["kind"] != "unidentifiable")

    def remove(self) -> None:
        """Takes away what belonged to a calibration that is no more."""
        for path in (self.file, self.findings_file):
            path.unlink(missing_ok=True)
        for chain in self._chains():
            self._forget(chain)

    def _tell_calibration(self, marginals: dict[str, dict[str, object]]) -> None:
        """Puts the posterior into ``calibration.json``; all else stays as it is."""
        path = self._session.results / "calibration.json"
        head = self._stamp.to_json()
        rest = {key: value for key, value in read_result_json(path).items() if key not in head}
        write_result_json(path, self._stamp, rest | {"posterior": marginals})

    def _refusal(self, why: str, chain: Path) -> str:
        return (
            f"{self.file}: not written, nor are intervals reported; found: {why}. The chain is kept in {chain}. "
            "Look into the flags of the fit trials, leave out faulty ones, try another [fit] seed in session.toml, or "
            "delete the chain to sample anew, and with the .npz beside it to search anew."
        )

    def _chains(self) -> list[Path]:
        """By their name; one that was stopped before the first step has a file of its search only."""
        kept = self._session.results.glob(".posterior-*")
        return sorted({path.with_suffix(".h5") for path in kept})

    def _chain(self) -> Path:
        """Where every step is kept while sampling; other calibrations' chains, and unreadable ones, are removed."""
        path = self._session.results / f".posterior-{self._drawn[:12]}.h5"
        for other in self._chains():
            if other != path:
                self._forget(other)
            elif other.exists() and not _readable(other):
                other.unlink()  # the search that it began with still stands
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
