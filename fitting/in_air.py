"""Experiments with the robot held in air, as a diagnosis uses them."""

from collections.abc import Sequence
from typing import NamedTuple

from fitting.free_decay import DecayTrial
from fitting.trial import MeasuredTrial


class ExperimentsInAir(NamedTuple):
    """Experiments without water.

    Attributes:
        runs: with the head clamped, measured as swims are.
        decays: of a tail that is let go.
    """

    runs: Sequence[MeasuredTrial] = ()
    decays: Sequence[DecayTrial] = ()


NOTHING = ExperimentsInAir()
