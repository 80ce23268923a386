"""Structure of the robot with which the swims are fitted, the sources of its numbers, and their uncertainty.

The chain of the dry experiments (`identify_structure`): free decays -> hinges -> dry runs with these hinges -> crank
arm. Other coefficients compensate hinges that are a little stiffer so well that swims alone do not determine these.
What the dry experiments did not measure is therefore free by a stated share; what they did, by its standard error
(`uncertainties_of`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fitting.crank_fit import CrankFit, CrankTrial, crank_response, fit_crank
from fitting.decay_fit import fit_decay
from fitting.dry_run import DryTrial, with_arm
from fitting.free_decay import DecayTrial
from fitting.hinges import DecayFit, HingeEstimate, combine_decays, fault_of_decay, with_hinges
from swimcal.errors import SimulationDiverged
from swimcal.flags import Flag
from swimcal.results import KEPT_ELSEWHERE, ResultFile
from swimcal.robot import RobotSpec
from swimcal.twin import Twin

BUILT_IN = "the built-in robot"
UNMEASURED_SD = {"hinge_stiffness": 0.1, "hinge_damping": 0.2, "crank_arm": 0.02}
"""Relative standard deviation of each number that nobody measured."""
WRONG_RUN = ("head_moves", "poor_fit")  # flags of a dry run that is not used with others
WRONG_ARM = ("at_bound", "unidentifiable")  # flags of all of them together, whose arm is not
_ANOTHER_ROBOT = 2.5  # ratio of measured to described stiffness that is flagged; a clock off by two makes it 4
Tell = Callable[[str], None]
"""Function that takes a message about the progress."""


class Source(NamedTuple):
    """Source of a number of the structure.

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
        """Return whether the number was taken over from the robot's description."""
        return not self.trials


@dataclass(frozen=True, eq=False)
class Structure:
    """Structure of the robot by its dry experiments, each building on the one before: hinges, then crank.

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

    def with_time_step(self, time_step_s: float) -> "Structure":
        """Return the same robot, simulated with another time step, s."""
        return replace(self, robot=self.robot.with_time_step(time_step_s))


STRUCTURE = ResultFile("structure.json", Structure, named=(DryTrial,), arrays_apart=True)
"""The file of the structure, in SI units, without the dry runs as measured and the robot's description."""


class Quantity(NamedTuple):
    """A number of the structure: key, words, unit, the unit shown and how many of it make one unit, and its getter."""

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
    """Return the structure of a robot none of whose dry experiments were recorded.

    Args:
        robot: the robot as described.
        origin: where it is described, for the reader.
    """
    hinges = (assumed_source(quantity, robot, origin, "no free decay") for quantity in HINGES)
    return Structure(robot, (), None, None, (*hinges, assumed_source(ARM, robot, origin, "no dry run")))


def read_structure(results: Path, robot: RobotSpec, runs: Sequence[DryTrial]) -> Structure:
    """Read ``structure.json``.

    Args:
        results: the folder of results.
        robot: the robot as described.
        runs: the dry runs as measured.

    Raises:
        InputError: there is none of this version.
    """
    found = STRUCTURE.read(results, {DryTrial: {run.name: run for run in runs}, "robot": robot})
    return replace(found, robot=with_sources(robot, found.sources))


def assumed_source(quantity: Quantity, robot: RobotSpec, origin: str, why: str) -> Source:
    """Return the source of a number as described, with the reason why it is not measured.

    Args:
        quantity: the number.
        robot: the robot as described.
        origin: where it is described, for the reader.
        why: the reason.
    """
    value = quantity.of(robot)
    shown = f"{quantity.shown * value:.4g} {quantity.shown_unit}"
    return Source(quantity.key, value, quantity.unit, None, (), f"{why}: {quantity.words} {shown} as in {origin}")


def measured_source(quantity: Quantity, value: float, se: float, trials: tuple[str, ...], experiment: str) -> Source:
    """Return the source of a measured number.

    Args:
        quantity: the number.
        value: its value, in the quantity's unit.
        se: standard error.
        trials: names of the trials it was measured in.
        experiment: the kind of experiment, in words.
    """
    digits = max(1 - int(np.floor(np.log10(quantity.shown * se))), 0) if se > 0 else 6  # two of the error
    shown = f"{quantity.shown * value:.{digits}f} ± {quantity.shown * se:.{digits}f} {quantity.shown_unit}"
    from_trials = f"{experiment}{'s' if len(trials) > 1 else ''} {', '.join(trials)}"
    sentence = f"{quantity.words} {shown} (standard error) from {from_trials}"
    return Source(quantity.key, value, quantity.unit, se, trials, sentence)


def with_sources(robot: RobotSpec, sources: Iterable[Source]) -> RobotSpec:
    """Return the robot with the numbers of these sources in the place of its own."""
    given = {source.quantity: source.value for source in sources}
    stiffness, damping, arm_m = (given.get(quantity.key, quantity.of(robot)) for quantity in (*HINGES, ARM))
    return with_arm(with_hinges(robot, stiffness, damping), arm_m)


class ParameterUncertainty(NamedTuple):
    """Uncertainty of a number of the robot: its relative standard deviation."""

    source: Source
    sd: float

    def robot(self, robot: RobotSpec, off: float) -> RobotSpec:
        """Return a robot whose number is off by a share of itself."""
        return with_sources(robot, (self.source._replace(value=(1 + off) * self.source.value),))


class PerturbedTwin(NamedTuple):
    """Twins with more and less of an uncertain number of the robot, by a relative step.

    The step does not depend on the uncertainty.
    """

    doubt: ParameterUncertainty
    more: Twin
    less: Twin
    step: float

    @property
    def per_sd(self) -> float:
        """Factor that turns the difference of the two into that of one standard deviation."""
        return self.doubt.sd / (2 * self.step)


def uncertainties_of(sources: Iterable[Source]) -> tuple[ParameterUncertainty, ...]:
    """Return the uncertainties: the standard error of what was measured, the stated share of what was not.

    A number that is 0 stays 0.
    """
    return tuple(
        ParameterUncertainty(source, UNMEASURED_SD[source.quantity] if source.se is None else source.se / source.value)
        for source in sources
        if source.value > 0
    )


def perturbed_twins(twin: Twin, doubts: Sequence[ParameterUncertainty]) -> tuple[PerturbedTwin, ...]:
    """Build two twins for each uncertain number."""

    def doubted(doubt: ParameterUncertainty) -> PerturbedTwin:
        step = UNMEASURED_SD[doubt.source.quantity]
        more, less = (twin.of_robot(doubt.robot(twin.robot, off)) for off in (step, -step))
        return PerturbedTwin(doubt, more, less, step)

    return tuple(map(doubted, doubts))


class DryExperiments(NamedTuple):
    """Recordings out of the water, as measured.

    Attributes:
        decays: the free decays.
        runs: the dry runs.
        unmeasured_decays, unmeasured_runs: by name, why others could not be measured, or must not be fitted.
    """

    decays: Sequence[DecayTrial] = ()
    runs: Sequence[DryTrial] = ()
    unmeasured_decays: Mapping[str, str] = MappingProxyType({})
    unmeasured_runs: Mapping[str, str] = MappingProxyType({})


def identify_structure(
    experiments: DryExperiments,
    robot: RobotSpec,
    origin: str = BUILT_IN,
    workers: int = 0,
    progress: Tell = lambda _message: None,
) -> Structure:
    """Identify the structure of a robot from its dry experiments; the rest is taken from its description.

    An experiment that could not be measured or must not be used is reported, not used.

    Args:
        experiments: the experiments as measured.
        robot: the robot as described.
        origin: where it is described, for the reader.
        workers: threads; 0 for all cores.
        progress: takes messages.

    Raises:
        NotEnoughData: the twin's tail moves smoothly over no range of crank arms.
        SimulationDiverged: the twin of a dry run does not stay bounded.
    """
    decays, unmeasured = [], dict(experiments.unmeasured_decays)
    for trial in experiments.decays:
        progress(f"fitting the free decay {trial.name}")
        try:
            decays.append(fit_decay(trial, robot, workers=workers))
        except SimulationDiverged as problem:
            unmeasured[trial.name] = str(problem)
    hinges, of_hinges, hinge_flags = _hinges(decays, unmeasured, robot, origin)
    hinged = with_sources(robot, of_hinges)
    if experiments.runs:
        progress(f"fitting the crank arm to {', '.join(trial.name for trial in experiments.runs)}")
    with _name_trials(_list_names("trial", [trial.name for trial in experiments.runs])):
        crank, of_arm, crank_flags = _crank(experiments, hinged, origin, workers)
    return Structure(
        robot=with_sources(hinged, (of_arm,)),
        decays=tuple(decays),
        hinges=hinges,
        crank=crank,
        sources=(*of_hinges, of_arm),
        flags=(*hinge_flags, *crank_flags),
    )


@contextmanager
def _name_trials(trials: str) -> Iterator[None]:
    """Name the trials whose twin diverged."""
    try:
        yield
    except SimulationDiverged as problem:
        raise SimulationDiverged(f"{trials}: {problem} If the recording shows something else, leave it out.") from None


def _hinges(
    fits: Sequence[DecayFit], unmeasured: Mapping[str, str], robot: RobotSpec, origin: str
) -> tuple[HingeEstimate | None, tuple[Source, ...], tuple[Flag, ...]]:
    refused = {**unmeasured} | {fit.name: why for fit in fits if (why := fault_of_decay(fit))}
    flags = tuple(_unused_flag(f"free decay {name}", why) for name, why in refused.items())
    used = [fit for fit in fits if fit.name not in refused]
    if not used:
        why = f"{_list_names('free decay', list(refused))} not used" if refused else "no free decay"
        return None, tuple(assumed_source(quantity, robot, origin, why) for quantity in HINGES), flags
    found, names = combine_decays(used), tuple(fit.name for fit in used)
    stiffness = measured_source(STIFFNESS, found.stiffness_n_m, found.stiffness_se_n_m, names, "free decay")
    damping = measured_source(DAMPING, found.damping_n_m_s, found.damping_se_n_m_s, names, "free decay")
    return found, (stiffness, damping), (*flags, *found.flags, *_off_robot(stiffness.value, robot, origin))


def _off_robot(n_m: float, robot: RobotSpec, origin: str) -> tuple[Flag, ...]:
    """Flag a measured stiffness of the hinges, N m/rad, that is another robot's, or goes by a wrong clock."""
    described = assumed_source(STIFFNESS, robot, origin, "").value
    if 1 / _ANOTHER_ROBOT < n_m / described < _ANOTHER_ROBOT:
        return ()
    message = (
        f"free decays give {n_m / described:.2g} times the hinge stiffness of {robot.name}, {described:.3g} N m/rad: "
        "is their frame rate right (stiffness goes with its square), and is it this robot?"
    )
    return (Flag("robot_off", message=message),)


def _crank(
    experiments: DryExperiments, robot: RobotSpec, origin: str, workers: int
) -> tuple[CrankFit | None, Source, tuple[Flag, ...]]:
    runs, unmeasured = experiments.runs, experiments.unmeasured_runs
    flags = tuple(_unused_flag(f"dry run {name}", why) for name, why in unmeasured.items())
    if not runs:
        why = f"{_list_names('dry run', list(unmeasured))} not used" if unmeasured else "no dry run"
        return None, assumed_source(ARM, robot, origin, why), flags
    fit, refused = _fit_used(runs, robot, workers)
    flags = (*flags, *(_unused_flag(f"dry run {name}", why) for name, why in refused.items()))
    names = tuple(trial.name for trial in fit.trials)
    whole = _list_names("dry run", list(names))
    fault = _first(fit.flags, WRONG_ARM)
    if fault is not None:
        flags = (*flags, _unused_flag(f"the crank arm of {whole}", fault))
    if fault is not None or len(refused) == len(runs):
        return fit, assumed_source(ARM, robot, origin, f"{whole} not used"), flags
    return fit, measured_source(ARM, fit.arm_m, fit.arm_se_m, names, "dry run"), (*flags, *fit.flags)


def _fit_used(runs: Sequence[DryTrial], robot: RobotSpec, workers: int) -> tuple[CrankFit, dict[str, str]]:
    """Return the fit of the runs that are used, of all where none is, and why the others are not.

    A wrong run makes the fit of the others poor as well, so the worst is left out first and the rest is fitted again.
    """
    response = crank_response(runs, robot, workers=workers)
    fit = whole = fit_crank(runs, robot, response=response, workers=workers)
    refused: dict[str, str] = {}
    while faults := {trial.name: fault for trial in fit.trials if (fault := _first(trial.flags, WRONG_RUN))}:
        worst = max((trial for trial in fit.trials if trial.name in faults), key=_misfit)
        refused[worst.name] = faults[worst.name]
        remaining = [run for run in runs if run.name not in refused]
        if not remaining:
            return whole, refused
        fit = fit_crank(remaining, robot, response=response, workers=workers)
    return fit, refused


def _misfit(trial: CrankTrial) -> float:
    """Return the error of the twin's motion over the swing of the tail; infinite where the head is not clamped."""
    moves = any(flag.kind == "head_moves" for flag in trial.flags)
    return np.inf if moves else trial.motion_error_m / trial.measured.frequency.amplitude_m


def _first(flags: tuple[Flag, ...], kinds: tuple[str, ...]) -> str | None:
    return next((flag.message for flag in flags if flag.kind in kinds), None)


def _unused_flag(what: str, why: str) -> Flag:
    return Flag("not_used", message=f"{what} is not used: {why}")


def _list_names(noun: str, names: list[str]) -> str:
    return f"{noun}{'s' if len(names) > 1 else ''} {', '.join(names)}"
