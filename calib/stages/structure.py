"""From the dry experiments of a session to the structure that its swims are fitted with."""

from pathlib import Path

from calib.options import Job
from calib.stages.recordings import Recordings
from fitting.structure import BUILT_IN, STRUCTURE, Structure, assumed, identify_structure, read_structure
from session.stage import Stage


class StructureStage(Stage):
    """``results/structure.json`` and its arrays in ``structure.npz``; neither is there without a dry experiment.

    Args:
        job: the work on the session.
        recordings: of the session.
    """

    def __init__(self, job: Job, recordings: Recordings) -> None:
        super().__init__(job.results / STRUCTURE.name, {}, {"form": 2}, [recordings])
        self._job, self._recordings = job, recordings

    def current(self) -> Structure:
        """What the dry experiments say, up to date, and what had to be assumed.

        Raises:
            InputError, NotEnoughData: what is wrong with the trials, all of them at once.
        """
        job = self._job
        if not self._recordings.has_experiments:
            return assumed(job.robot, self._origin)
        self.ensure(self._make)
        return read_structure(job.results, job.robot, self._recordings.experiments.runs)

    @property
    def _origin(self) -> str:
        """Where the robot is described, for the reader."""
        file = self._job.session.robot_file
        return BUILT_IN if file is None else file.name

    def _make(self) -> tuple[Path, ...]:
        job, experiments = self._job, self._recordings.experiments
        found = identify_structure(experiments, job.robot, self._origin, job.options.workers, job.tell)
        written = STRUCTURE.write(job.results, job.provenance, found)
        job.made.extend(written)
        for source in found.sources:
            job.tell(source.sentence)
        return written
