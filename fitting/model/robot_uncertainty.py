"""How well the robot itself is known: hinges and crank arm that nobody measured may be off, and coefficients make up.

Hinges that are a little stiffer are answered with other coefficients so well that swims alone do not tell. What the dry
experiments did not measure is therefore free by a stated share; what they did, by its standard error.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fitting.structure import Source
from fitting.structure.sources import with_sources
from swimmer import RobotSpec, Twin

UNMEASURED_SD = {"hinge_stiffness": 0.1, "hinge_damping": 0.2, "crank_arm": 0.02}
"""Relative standard deviation of what nobody measured."""


class ParameterUncertainty(NamedTuple):
    """How far a number of the robot may be off.

    Attributes:
        source: of the number.
        sd: relative standard deviation.
    """

    source: Source
    sd: float

    def robot(self, robot: RobotSpec, off: float) -> RobotSpec:
        """A robot whose number is off by a share of itself."""
        return with_sources(robot, (self.source._replace(value=(1 + off) * self.source.value),))


class PerturbedTwin(NamedTuple):
    """A twin on either side of what is believed, by a step that is the same however sure one is.

    Attributes:
        doubt: whose number differs.
        more, less: twins of robots with more and less of it.
        step: relative, from what is believed to either.
    """

    doubt: ParameterUncertainty
    more: Twin
    less: Twin
    step: float

    @property
    def per_sd(self) -> float:
        """What the difference of the two is to be multiplied with for one standard deviation."""
        return self.doubt.sd / (2 * self.step)


def uncertainties_of(sources: Iterable[Source]) -> tuple[ParameterUncertainty, ...]:
    """By the standard error of what was measured, by the stated share of what was not; a number that is 0 stays 0."""
    return tuple(
        ParameterUncertainty(source, UNMEASURED_SD[source.quantity] if source.se is None else source.se / source.value)
        for source in sources
        if source.value > 0
    )


def perturbed_twins(twin: Twin, doubts: Sequence[ParameterUncertainty]) -> tuple[PerturbedTwin, ...]:
    """Two twins for each doubt."""

    def doubted(doubt: ParameterUncertainty) -> PerturbedTwin:
        step = UNMEASURED_SD[doubt.source.quantity]
        more, less = (twin.of_robot(doubt.robot(twin.robot, off)) for off in (step, -step))
        return PerturbedTwin(doubt, more, less, step)

    return tuple(map(doubted, doubts))
