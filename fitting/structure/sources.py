"""The structure of the robot that the swims are fitted with, where its numbers come from, and how well they are known.

Hinges that are a little stiffer are answered with other coefficients so well that swims alone do not tell. What the dry
experiments did not measure is therefore free by a stated share; what they did, by its standard error.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fitting.dry_run import CrankFit, DryTrial
from fitting.dry_run.response import with_arm
from fitting.free_decay import DecayFit, HingeEstimate
from fitting.free_decay.hinges import with_hinges
from session import Flag
from session.records import KEPT_ELSEWHERE
from session.results import ResultFile
from swimmer import RobotSpec, Twin

BUILT_IN = "the built-in robot"
UNMEASURED_SD = {"hinge_stiffness": 0.1, "hinge_damping": 0.2, "crank_arm": 0.02}
"""Relative standard deviation of what nobody measured."""


class Source(NamedTuple):
    """Where a number of the structure comes from.

    Attributes:
        quantity: "hinge_stiffness", "hinge_damping" or "crank_arm".
        value: the number, in `unit`.
        unit: "N m/rad", "N m s/rad" or "m".
        se: standard error; null where the value is assumed.
        trials: names of the trials it was measured in; none where it is assumed.
        sentence: value and source in words and, where it is assumed, why.
    """

    quantity: str
    value: float
    unit: str
    se: float | None
    trials: tuple[str, ...]
    sentence: str

    @property
    def assumed(self) -> bool:
        """Whether it was taken over from the robot's description."""
        return not self.trials


@dataclass(frozen=True, eq=False)
class Structure:
    """What the dry experiments say about the robot, each building on the one before: hinges, then crank.

    Attributes:
        robot: as described, with what was measured in the place of what was assumed.
        decays: every free decay and its twin, used or not.
        hinges: stiffness and damping from the decays that are used; null without one.
        crank: crank arm from the dry runs that are used, else, unused, from all of them; null without one.
        sources: where hinge stiffness, hinge damping and crank arm come from, in this order.
        flags: which experiments are not used, and the flags of those that are.
    """

    robot: RobotSpec = field(metadata=KEPT_ELSEWHERE)
    decays: tuple[DecayFit, ...]
    hinges: HingeEstimate | None
    crank: CrankFit | None
    sources: tuple[Source, ...]
    flags: tuple[Flag, ...] = ()


STRUCTURE = ResultFile("structure.json", Structure, named=(DryTrial,), arrays_apart=True)
"""In SI units, without the dry runs as measured and the robot's description."""


class Quantity(NamedTuple):
    """A number of the structure: key, words, unit, the unit shown and how many of it make one unit, and whose it is."""

    key: str
    words: str
    unit: str
    shown_unit: str
    shown: float
    of: Callable[[RobotSpec], float]


STIFFNESS = Quantity(
    "hinge_stiffness", "hinge stiffness", "N m/rad", "N m/rad", 1.0, lambda robot: robot.tail.hinge_stiffness_n_m
)
DAMPING = Quantity(
    "hinge_damping", "hinge damping", "N m s/rad", "N m s/rad", 1.0, lambda robot: robot.tail.hinge_damping_n_m_s
)
ARM = Quantity("crank_arm", "crank arm", "m", "mm", 1000.0, lambda robot: robot.crank.arm_m)
HINGES = (STIFFNESS, DAMPING)


def assumed(robot: RobotSpec, origin: str = BUILT_IN) -> Structure:
    """The structure of a robot none of whose dry experiments were recorded.

    Args:
        robot: as described.
        origin: where it is described, for the reader.
    """
    hinges = (assumed_source(quantity, robot, origin, "no free decay") for quantity in HINGES)
    return Structure(robot, (), None, None, (*hinges, assumed_source(ARM, robot, origin, "no dry run")))


def read_structure(results: Path, robot: RobotSpec, runs: Sequence[DryTrial]) -> Structure:
    """Reads ``structure.json``.

    Args:
        results: the folder.
        robot: as described.
        runs: the dry runs as measured.

    Raises:
        InputError: there is none of this version.
    """
    found = STRUCTURE.read(results, {DryTrial: {run.name: run for run in runs}, "robot": robot})
    return replace(found, robot=with_sources(robot, found.sources))


def assumed_source(quantity: Quantity, robot: RobotSpec, origin: str, why: str) -> Source:
    """A number as described, and why it is not measured."""
    value = quantity.of(robot)
    shown = f"{quantity.shown * value:.4g} {quantity.shown_unit}"
    return Source(quantity.key, value, quantity.unit, None, (), f"{why}: {quantity.words} {shown} as in {origin}")


def measured_source(quantity: Quantity, value: float, se: float, trials: tuple[str, ...], experiment: str) -> Source:
    """A number, in the quantity's unit, with its standard error from these trials of an experiment."""
    digits = max(1 - int(np.floor(np.log10(quantity.shown * se))), 0) if se > 0 else 6  # two of the error
    shown = f"{quantity.shown * value:.{digits}f} ± {quantity.shown * se:.{digits}f} {quantity.shown_unit}"
    from_trials = f"{experiment}{'s' if len(trials) > 1 else ''} {', '.join(trials)}"
    sentence = f"{quantity.words} {shown} (standard error) from {from_trials}"
    return Source(quantity.key, value, quantity.unit, se, trials, sentence)


def with_sources(robot: RobotSpec, sources: Iterable[Source]) -> RobotSpec:
    """The robot with the numbers of these sources in the place of its own."""
    given = {source.quantity: source.value for source in sources}
    stiffness, damping, arm_m = (given.get(quantity.key, quantity.of(robot)) for quantity in (*HINGES, ARM))
    return with_arm(with_hinges(robot, stiffness, damping), arm_m)


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
