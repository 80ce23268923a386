"""Free decays that a diagnosis may believe."""

from collections.abc import Sequence
from contextlib import suppress

from fitting.free_decay import DecayTrial, Ring, fit_decay
from fitting.structure.belief import doubt_of_decay
from session import SimulationDiverged
from swimmer import Twin


def rings_of(decays: Sequence[DecayTrial], twin: Twin) -> tuple[Ring, ...]:
    """How they ring; without those whose fit must not be believed (`fitting.structure.belief`).

    Args:
        decays: as measured.
        twin: of the robot as described.
    """
    found = []
    for trial in decays:
        with suppress(SimulationDiverged):
            fit = fit_decay(trial, twin.robot, workers=twin.workers)
            if doubt_of_decay(fit) is None:
                found.append(Ring.of(trial, fit))
    return tuple(found)
