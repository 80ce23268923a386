"""Sentences about where the numbers of a structure come from."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from fitting.dry_run import CrankFit
from fitting.dry_run.response import with_arm
from fitting.free_decay import HingeEstimate
from fitting.free_decay.hinges import hinges_of, with_hinges
from fitting.structure.structure import BUILT_IN, Source, Structure
from swimmer import RobotSpec


class _Quantity(NamedTuple):
    """A number of the structure: key, words, unit, the unit shown and how many of it make one unit."""

    key: str
    words: str
    unit: str
    shown_unit: str
    shown: float = 1.0


STIFFNESS = _Quantity("hinge_stiffness", "hinge stiffness", "N m/rad", "N m/rad")
DAMPING = _Quantity("hinge_damping", "hinge damping", "N m s/rad", "N m s/rad")
ARM = _Quantity("crank_arm", "crank arm", "m", "mm", 1000.0)


def assumed(robot: RobotSpec, origin: str = BUILT_IN) -> Structure:
    """The structure of a robot none of whose dry experiments were recorded.

    Args:
        robot: as described.
        origin: where it is described, for the reader.
    """
    sources = (*assumed_hinges(robot, origin, "no free decay"), assumed_arm(robot, origin, "no dry run"))
    return Structure(robot, (), None, None, sources)


def assumed_hinges(robot: RobotSpec, origin: str, why: str) -> tuple[Source, Source]:
    """Stiffness and damping of the hinges as described."""
    tail = robot.tail
    stiffness = _assumed(STIFFNESS, tail.hinge_stiffness_n_m, origin, why)
    return stiffness, _assumed(DAMPING, tail.hinge_damping_n_m_s, origin, why)


def assumed_arm(robot: RobotSpec, origin: str, why: str) -> Source:
    """The crank arm as described."""
    return _assumed(ARM, robot.crank.arm_m, origin, why)


def measured_hinges(hinges: HingeEstimate, trials: tuple[str, ...]) -> tuple[Source, Source]:
    """Stiffness and damping of the hinges from these free decays."""
    stiffness = _measured(STIFFNESS, hinges.stiffness_n_m, hinges.stiffness_se_n_m, trials, "free decay")
    return stiffness, _measured(DAMPING, hinges.damping_n_m_s, hinges.damping_se_n_m_s, trials, "free decay")


def measured_arm(crank: CrankFit) -> Source:
    """The crank arm from its dry runs."""
    return _measured(ARM, crank.arm_m, crank.arm_se_m, tuple(trial.name for trial in crank.trials), "dry run")


def _assumed(quantity: _Quantity, value: float, origin: str, why: str) -> Source:
    shown = f"{quantity.shown * value:.4g} {quantity.shown_unit}"
    return Source(quantity.key, value, quantity.unit, None, (), f"{why}: {quantity.words} {shown} as in {origin}")


def _measured(quantity: _Quantity, value: float, se: float, trials: tuple[str, ...], experiment: str) -> Source:
    shown = f"{_with_error(quantity.shown * value, quantity.shown * se)} {quantity.shown_unit}"
    from_trials = f"{experiment}{'s' if len(trials) > 1 else ''} {', '.join(trials)}"
    return Source(
        quantity.key, value, quantity.unit, se, trials, f"{quantity.words} {shown} (standard error) from {from_trials}"
    )


def _with_error(value: float, se: float) -> str:
    """`0.743 ± 0.011`: two digits of the error, and as many decimals of the value."""
    decimals = max(1 - int(np.floor(np.log10(se))), 0) if se > 0 else 6
    return f"{value:.{decimals}f} ± {se:.{decimals}f}"


def with_sources(robot: RobotSpec, sources: Iterable[Source]) -> RobotSpec:
    """The robot with the numbers of these sources in the place of its own."""
    value = {source.quantity: source.value for source in sources}
    stiffness, damping = hinges_of(robot)
    hinged = with_hinges(robot, value.get(STIFFNESS.key, stiffness), value.get(DAMPING.key, damping))
    return with_arm(hinged, value.get(ARM.key, robot.crank.arm_m))
