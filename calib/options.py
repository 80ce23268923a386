"""The options of the work on one session: `Options` are shared by every command, `Job` by every stage.

Nothing that takes long to load is loaded before there is work: every use of `calib` begins here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from fitting.progress import Progress
from swimcal.errors import Fault, InputError
from swimcal.results import Provenance
from swimcal.session import Session, file_hashes

if TYPE_CHECKING:
    from swimcal.robot import RobotSpec
    from tracking.follow_video import TrackerName

EffortName = Literal["quick", "full"]
LastStepName = Literal["fit", "posterior", "diagnosis"]
"""The last step of a run before its report."""
ObjectiveName = Literal["likelihood", "published"]
STARTS = {"quick": 2, "full": 4}
"""Number of starts of the search for the coefficients, by effort."""
PUBLISHED_S = {"quick": 3_000.0, "full": 18_000.0}
"""Seconds that the published search may simulate, by effort."""


@dataclass(frozen=True)
class Options:
    """The options of the work on a session.

    Attributes:
        effort: None for that of the current results, full where there are none.
        workers: threads, 0 for all cores.
        tracker: None for that of the existing tracks.
        progress: called with what is going on.
    """

    effort: EffortName | None = None
    workers: int = 0
    tracker: TrackerName | None = None
    progress: Progress = lambda _message, _share: None

    def __post_init__(self) -> None:
        """Refuse an effort that does not exist, before anything is compared with it."""
        if self.effort is not None and self.effort not in get_args(EffortName):
            raise InputError([Fault("effort", "", "no such effort", repr(self.effort), "", get_args(EffortName))])


@dataclass(frozen=True, eq=False)
class Job:
    """The work on one session: the files made, in their order, and notes, sentences for the user."""

    session: Session
    options: Options
    made: list[Path] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def results(self) -> Path:
        """The folder of the results."""
        return self.session.results

    @cached_property
    def robot(self) -> RobotSpec:
        """The session's robot, as described."""
        from swimcal.robot import load_robot

        return load_robot(self.session.robot_file)

    @cached_property
    def provenance(self) -> Provenance:
        """The provenance with which every result of this work is stamped."""
        from swimcal.runs import ENGINE, model_sha256

        inputs, sha256 = file_hashes(self.session), model_sha256(self.robot)
        return Provenance(ENGINE, sha256, inputs, self.session.seed, self.options.effort or "full")

    def note_incomplete(self, file: Path | None) -> None:
        """Note that results are made again because the end of a file was missing; do nothing where none was."""
        if file is not None:
            self.notes.append(f"{file.name} was incomplete: its end was missing or damaged. It was made again.")

    def progress(self, message: str, share: float | None = None) -> None:
        """Report what is going on, and the share done where it is known."""
        self.options.progress(message, share)

    def progress_of(self, step: str) -> Progress:
        """Return the progress of one step, whose shares are its own: the messages begin with its name."""
        return lambda message, share: self.options.progress(f"{step}: {message}", share)
