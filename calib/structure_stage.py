"""From the dry experiments of a session to the structure that its swims are fitted with."""

from functools import cached_property
from pathlib import Path

import numpy as np

from calib.options import Options
from calib.recordings import Recordings
from fitting.structure import BUILT_IN, Structure, assumed, identify_structure, read_structure, structure_payload
from session import (
    Provenance,
    Session,
    is_current,
    mark_current,
    read_result_json,
    write_result_json,
    writing_whole,
)
from swimmer import RobotSpec


class StructureStage:
    """``results/structure.json`` and its arrays in ``structure.npz``; neither is there without a dry experiment.

    Args:
        session: as read.
        robot: as described.
        recordings: of the session.
        options: threads, progress.
        stamp: what results are stamped with.
    """

    def __init__(
        self, session: Session, robot: RobotSpec, recordings: Recordings, options: Options, stamp: Provenance
    ) -> None:
        self._session, self._robot, self._recordings = session, robot, recordings
        self._options, self._stamp = options, stamp
        self.made: list[Path] = []

    @property
    def file(self) -> Path:
        """``results/structure.json``."""
        return self._session.results / "structure.json"

    @property
    def is_current(self) -> bool:
        """Whether nothing has to be found any more."""
        return not self._recordings.has_experiments or is_current(self.file, self._recordings.fingerprint)

    @cached_property
    def structure(self) -> Structure:
        """What the dry experiments say, up to date, and what had to be assumed.

        Raises:
            InputError, NotEnoughData: what is wrong with the trials, all of them at once.
        """
        if not self._recordings.has_experiments:
            return assumed(self._robot, self._origin)
        return self._read() if self.is_current else self._identify()

    @property
    def _origin(self) -> str:
        """Where the robot is described, for the reader."""
        return BUILT_IN if self._session.robot_file is None else self._session.robot_file.name

    def _read(self) -> Structure:
        with np.load(self._arrays) as arrays:
            runs = self._recordings.experiments.runs
            return read_structure(read_result_json(self.file), arrays, self._robot, runs)

    def _identify(self) -> Structure:
        tell, experiments = self._options.tell, self._recordings.experiments
        structure = identify_structure(
            experiments, self._robot, self._origin, self._options.workers, lambda message: tell(message, None)
        )
        payload, arrays = structure_payload(structure)
        with writing_whole(self._arrays) as part:
            np.savez_compressed(part, allow_pickle=False, **arrays)
        write_result_json(self.file, self._stamp, payload)
        mark_current(self.file, self._recordings.fingerprint, [self._arrays])
        self.made += [self.file, self._arrays]
        for source in structure.sources:
            tell(source.sentence, None)
        return structure

    @property
    def _arrays(self) -> Path:
        return self.file.with_suffix(".npz")
