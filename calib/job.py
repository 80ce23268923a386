"""The work on one session: what every stage has to know, and what is told of it."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from calib.options import Options
from session import Session
from session.folder import file_hashes
from session.results import Provenance
from swimmer import RobotSpec, load_robot
from swimmer.engine import ENGINE, model_sha256


@dataclass(frozen=True, eq=False)
class Job:
    """The work on one session.

    Attributes:
        session: as read.
        options: effort, threads, progress.
        made: files, in the order in which they were made.
        said: sentences for the user.
    """

    session: Session
    options: Options
    made: list[Path] = field(default_factory=list)
    said: list[str] = field(default_factory=list)

    @property
    def results(self) -> Path:
        """The folder of the results."""
        return self.session.results

    @cached_property
    def robot(self) -> RobotSpec:
        """The session's robot, as described."""
        return load_robot(self.session.robot_file)

    @cached_property
    def provenance(self) -> Provenance:
        """What every result of this work is stamped with."""
        inputs, sha256 = file_hashes(self.session), model_sha256(self.robot)
        return Provenance(ENGINE, sha256, inputs, self.session.seed, self.options.effort)

    def tell(self, message: str, share: float | None = None) -> None:
        """Tells what is going on, and the share done where it is known."""
        self.options.tell(message, share)
