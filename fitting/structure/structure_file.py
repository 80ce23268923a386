"""`results/structure.json`, with its arrays beside it in `structure.npz`: the structure in SI units, and back."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from fitting.dry_run import DryTrial
from fitting.structure.records import Named, from_plain, to_plain
from fitting.structure.sources import with_sources
from fitting.structure.structure import Structure
from swimmer import RobotSpec

PARTS = ("sources", "decays", "hinges", "crank", "flags")


class StructureFile(NamedTuple):
    """Everything of `structure.json` but its provenance, and the arrays that it names."""

    payload: dict[str, Any]
    arrays: dict[str, np.ndarray]


def structure_payload(structure: Structure) -> StructureFile:
    """The structure without its robot, which is described elsewhere, and its dry runs as measured."""
    arrays: dict[str, np.ndarray] = {}
    payload = {part: to_plain(getattr(structure, part), (DryTrial,), arrays, part) for part in PARTS}
    return StructureFile(payload, arrays)


def read_structure(
    data: Mapping[str, Any], arrays: Mapping[str, np.ndarray], robot: RobotSpec, runs: Sequence[DryTrial]
) -> Structure:
    """What `structure_payload` gave.

    Args:
        data: of `structure.json`.
        arrays: of `structure.npz`.
        robot: as described.
        runs: the dry runs as measured.
    """
    types = get_type_hints(Structure)
    named: Named = {DryTrial: {run.name: run for run in runs}}
    parts = {part: from_plain(types[part], data[part], named, arrays) for part in PARTS}
    return Structure(with_sources(robot, parts["sources"]), **parts)
