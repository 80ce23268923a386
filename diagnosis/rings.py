"""Free decays that a diagnosis may believe."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fitting.free_decay import DecayTrial, Ring, fit_decay
from fitting.free_decay.decay_flags import doubt_of_decay
from session.errors import SimulationDiverged
from swimmer import Twin


class Rings(NamedTuple):
    """Of all decays of a session.

    Attributes:
        believed: how they ring.
        left_out: by name, why others do not count.
    """

    believed: tuple[Ring, ...]
    left_out: Mapping[str, str]


def rings_of(decays: Sequence[DecayTrial], twin: Twin) -> Rings:
    """How they ring; without those whose fit must not be believed (`fitting.structure.belief`).

    Args:
        decays: as measured.
        twin: of the robot as described.
    """
    believed, left_out = [], {}
    for trial in decays:
        try:
            fit = fit_decay(trial, twin.robot, workers=twin.workers)
            doubt, ring = doubt_of_decay(fit), Ring.of(trial, fit, twin.robot)
            if doubt is None and not np.isfinite(ring.of_twin(twin)).all():
                doubt = "a twin with the fitted hinges does not stand"
        except SimulationDiverged as problem:
            doubt = str(problem)
        if doubt is None:
            believed.append(ring)
        else:
            left_out[trial.name] = doubt
    return Rings(tuple(believed), left_out)
