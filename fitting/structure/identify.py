"""The chain of the dry experiments: free decays -> hinges -> dry runs with these hinges -> crank arm."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fitting.dry_run import CrankFit, CrankTrial, DryTrial, crank_response, fit_crank
from fitting.free_decay import DecayFit, DecayTrial, HingeEstimate, combine_decays, fit_decay
from fitting.free_decay.hinges import fault_of_decay
from fitting.structure.sources import (
    ARM,
    BUILT_IN,
    DAMPING,
    HINGES,
    STIFFNESS,
    Source,
    Structure,
    assumed_source,
    measured_source,
    with_sources,
)
from session import Flag
from session.errors import SimulationDiverged
from swimmer import RobotSpec

WRONG_RUN = ("head_moves", "poor_fit")  # flags of a dry run that is not used with others
WRONG_ARM = ("at_bound", "unidentifiable")  # flags of all of them together, whose arm is not
Progress = Callable[[str], None]
"""Called with what is going on."""


class DryExperiments(NamedTuple):
    """What was recorded out of the water, as measured.

    Attributes:
        decays, runs: free decays and dry runs.
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
    progress: Progress = lambda _message: None,
) -> Structure:
    """The structure of a robot from its dry experiments; what they do not determine is taken from its description.

    An experiment that could not be measured or must not be used is reported, not used.

    Args:
        experiments: as measured.
        robot: as described.
        origin: where it is described, for the reader.
        workers: threads; 0 for all cores.
        progress: receives it.

    Raises:
        NotEnoughData: the twin's tail moves smoothly over no range of crank arms.
        SimulationDiverged: the twin does not stay bounded.
    """
    decays = []
    for trial in experiments.decays:
        progress(f"fitting the free decay {trial.name}")
        with _named(f"trial {trial.name}"):
            decays.append(fit_decay(trial, robot, workers=workers))
    hinges, of_hinges, hinge_flags = _hinges(decays, experiments.unmeasured_decays, robot, origin)
    hinged = with_sources(robot, of_hinges)
    if experiments.runs:
        progress(f"fitting the crank arm to {', '.join(trial.name for trial in experiments.runs)}")
    with _named(_listed("trial", [trial.name for trial in experiments.runs])):
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
def _named(trials: str) -> Iterator[None]:
    """Says whose twin it was that diverged."""
    try:
        yield
    except SimulationDiverged as problem:
        raise SimulationDiverged(f"{trials}: {problem} If the recording shows something else, leave it out.") from None


def _hinges(
    fits: Sequence[DecayFit], unmeasured: Mapping[str, str], robot: RobotSpec, origin: str
) -> tuple[HingeEstimate | None, tuple[Source, ...], tuple[Flag, ...]]:
    """The common fit of the free decays, where stiffness and damping are from, and which decays are not used."""
    refused = {**unmeasured} | {fit.name: why for fit in fits if (why := fault_of_decay(fit))}
    flags = tuple(_not_used(f"free decay {name}", why) for name, why in refused.items())
    used = [fit for fit in fits if fit.name not in refused]
    if not used:
        why = f"{_listed('free decay', list(refused))} not used" if refused else "no free decay"
        return None, tuple(assumed_source(quantity, robot, origin, why) for quantity in HINGES), flags
    found, names = combine_decays(used), tuple(fit.name for fit in used)
    stiffness = measured_source(STIFFNESS, found.stiffness_n_m, found.stiffness_se_n_m, names, "free decay")
    damping = measured_source(DAMPING, found.damping_n_m_s, found.damping_se_n_m_s, names, "free decay")
    return found, (stiffness, damping), (*flags, *found.flags)


def _crank(
    experiments: DryExperiments, robot: RobotSpec, origin: str, workers: int
) -> tuple[CrankFit | None, Source, tuple[Flag, ...]]:
    """The common fit of the dry runs, where the arm is from, and which runs are not used."""
    runs, unmeasured = experiments.runs, experiments.unmeasured_runs
    flags = tuple(_not_used(f"dry run {name}", why) for name, why in unmeasured.items())
    if not runs:
        why = f"{_listed('dry run', list(unmeasured))} not used" if unmeasured else "no dry run"
        return None, assumed_source(ARM, robot, origin, why), flags
    fit, refused = _fit_of_used(runs, robot, workers)
    flags = (*flags, *(_not_used(f"dry run {name}", why) for name, why in refused.items()))
    names = tuple(trial.name for trial in fit.trials)
    whole = _listed("dry run", list(names))
    fault = _first(fit.flags, WRONG_ARM)
    if fault is not None:
        flags = (*flags, _not_used(f"the crank arm of {whole}", fault))
    if fault is not None or len(refused) == len(runs):
        return fit, assumed_source(ARM, robot, origin, f"{whole} not used"), flags
    return fit, measured_source(ARM, fit.arm_m, fit.arm_se_m, names, "dry run"), (*flags, *fit.flags)


def _fit_of_used(runs: Sequence[DryTrial], robot: RobotSpec, workers: int) -> tuple[CrankFit, dict[str, str]]:
    """The fit of the runs that are used, of all where none is, and why the others are not.

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
    """How far the twin's motion is off, over the swing of the tail; infinite where the head is not clamped."""
    moves = any(flag.kind == "head_moves" for flag in trial.flags)
    return np.inf if moves else trial.motion_error_m / trial.measured.frequency.amplitude_m


def _first(flags: tuple[Flag, ...], kinds: tuple[str, ...]) -> str | None:
    """The message of the first flag of these kinds."""
    return next((flag.message for flag in flags if flag.kind in kinds), None)


def _not_used(what: str, why: str) -> Flag:
    return Flag("not_used", message=f"{what} is not used: {why}")


def _listed(noun: str, names: list[str]) -> str:
    return f"{noun}{'s' if len(names) > 1 else ''} {', '.join(names)}"
