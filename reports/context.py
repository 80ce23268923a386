"""The context of a report: everything that a section may read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

from diagnosis.result import DiagnosisResult
from fitting import CalibratedTrial, Calibration, MeasuredTrial, Structure
from fitting.calibration_file import PublishedResult, calibration_result
from fitting.dry_run import DryTrial
from reports.answers import Answers, answers_of
from reports.logged_trial import LoggedTrial
from reports.policy_swims import PolicySwims
from session import Session
from session.results import Provenance
from swimmer import RobotSpec

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary  # its package loads the sampler


class NoSwims(NamedTuple):
    """A stand-in for the calibration of a session without a swim trial."""

    structure: Structure
    trials: tuple[CalibratedTrial, ...] = ()

    @property
    def robot(self) -> RobotSpec:
        """The robot with this structure."""
        return self.structure.robot


@dataclass(frozen=True, eq=False)
class ReportContext:
    """The results of one session.

    Attributes:
        notes: further sentences for the reader, such as what was left out.
        published: what the published search leads to; None where it was not run.
        posterior: how sure the coefficients are; None where it was not sampled.
        diagnosed: where the sim-to-real gap is and what causes it; None where it was not diagnosed.
        policies: how the trained policies swim, targets first.
        damaged: the file of "posterior" or "diagnosis" that cannot be read, where there is one.
    """

    session: Session
    calibration: Calibration
    provenance: Provenance
    notes: tuple[str, ...] = ()
    published: PublishedResult | None = None
    posterior: PosteriorSummary | None = None
    diagnosed: DiagnosisResult | None = None
    diagnosis_effort: str = "full"
    policies: tuple[PolicySwims, ...] = ()
    damaged: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def answers(self) -> Answers:
        """The answers to what a reader asks first."""
        found = calibration_result(self.calibration)
        return answers_of(found, self.posterior, self.diagnosed, self.session.folder.name, self.damaged)

    def trials(self, role: str) -> tuple[CalibratedTrial, ...]:
        """Return the fit or the held-out trials, in the order of the session."""
        return tuple(trial for trial in self.calibration.trials if trial.measured.role == role)

    @property
    def driven(self) -> tuple[tuple[DryTrial | MeasuredTrial, Literal["dry", "swim"]], ...]:
        """Dry runs and swims with their kind, in the order of the chain."""
        crank = self.calibration.structure.crank
        dry = crank.trials if crank else ()
        return (
            *((run.measured, "dry") for run in dry),
            *((trial.measured, "swim") for trial in self.calibration.trials),
        )

    @property
    def logged(self) -> tuple[LoggedTrial, ...]:
        """The driven trials that have a motor log."""
        return tuple(LoggedTrial(trial.name, kind, trial.motor) for trial, kind in self.driven if trial.motor)

    @property
    def even(self) -> list[str]:
        """Names of the trials whose crank is taken to turn evenly, for want of a log to follow."""
        followed = [trial.name for trial in self.logged if trial.motor.usable]
        return [trial.name for trial, _ in self.driven if trial.name not in followed]
