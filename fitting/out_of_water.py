"""What a diagnosis reads of a robot that is held in air."""

from collections.abc import Sequence
from typing import NamedTuple

from fitting.free_decay import DecayTrial
from fitting.trial import MeasuredTrial


class OutOfWater(NamedTuple):
    """Experiments that know no water.

    Attributes:
        runs: with the head clamped, measured as swims are.
        decays: of a tail that is let go.
    """

    runs: Sequence[MeasuredTrial] = ()
    decays: Sequence[DecayTrial] = ()


NOTHING = OutOfWater()
