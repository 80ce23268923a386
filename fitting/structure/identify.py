"""The chain of the dry experiments: free decays -> hinges -> dry runs with these hinges -> crank arm."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fitting.dry_run import CrankFit, CrankTrial, DryTrial, crank_response, fit_crank
from fitting.free_decay import DecayFit, DecayTrial, HingeEstimate, combine_decays, fit_decay
from fitting.structure.belief import doubt_of_arm, doubt_of_decay, doubt_of_run
from fitting.structure.sources import assumed_arm, assumed_hinges, measured_arm, measured_hinges, with_sources
from fitting.structure.structure import BUILT_IN, Source, Structure
from session import Flag, SimulationDiverged
from swimmer import RobotSpec

Tell = Callable[[str], None]
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
    tell: Tell = lambda _message: None,
) -> Structure:
    """The structure of a robot from its dry experiments; what they do not tell is taken from its description.

    An experiment that could not be measured or must not be believed (`fitting.structure.belief`) is reported, not used.

    Args:
        experiments: as measured.
        robot: as described.
        origin: where it is described, for the reader.
        workers: threads; 0 for all cores.
        tell: receives progress.

    Raises:
        NotEnoughData: the twin's tail moves smoothly over no range of crank arms.
        SimulationDiverged: the twin does not stay bounded.
    """
    decays = []
    for trial in experiments.decays:
        tell(f"fitting the free decay {trial.name}")
        with _named(f"trial {trial.name}"):
            decays.append(fit_decay(trial, robot, workers=workers))
    hinges = _hinges(decays, experiments.unmeasured_decays, robot, origin)
    hinged = with_sources(robot, hinges.sources)
    if experiments.runs:
        tell(f"fitting the crank arm to {', '.join(trial.name for trial in experiments.runs)}")
    with _named(_listed("trial", [trial.name for trial in experiments.runs])):
        crank = _crank(experiments, hinged, origin, workers)
    return Structure(
        robot=with_sources(hinged, (crank.source,)),
        decays=tuple(decays),
        hinges=hinges.estimate,
        crank=crank.fit,
        sources=(*hinges.sources, crank.source),
        flags=(*hinges.flags, *crank.flags),
    )


@contextmanager
def _named(trials: str) -> Iterator[None]:
    """Says whose twin it was that diverged."""
    try:
        yield
    except SimulationDiverged as problem:
        raise SimulationDiverged(f"{trials}: {problem} If the recording shows something else, leave it out.") from None


class _Hinges(NamedTuple):
    """What the free decays say together."""

    estimate: HingeEstimate | None
    sources: tuple[Source, Source]
    flags: tuple[Flag, ...]


def _hinges(fits: Sequence[DecayFit], unmeasured: Mapping[str, str], robot: RobotSpec, origin: str) -> _Hinges:
    doubts = {**unmeasured} | {fit.name: doubt for fit in fits if (doubt := doubt_of_decay(fit))}
    flags = tuple(_not_used(f"free decay {name}", doubt) for name, doubt in doubts.items())
    believed = [fit for fit in fits if fit.name not in doubts]
    if believed:
        estimate = combine_decays(believed)
        names = tuple(fit.name for fit in believed)
        return _Hinges(estimate, measured_hinges(estimate, names), (*flags, *estimate.flags))
    why = f"{_listed('free decay', list(doubts))} not used" if doubts else "no free decay"
    return _Hinges(None, assumed_hinges(robot, origin, why), flags)


class _Crank(NamedTuple):
    """What the dry runs say together."""

    fit: CrankFit | None
    source: Source
    flags: tuple[Flag, ...]


def _crank(experiments: DryExperiments, robot: RobotSpec, origin: str, workers: int) -> _Crank:
    runs, unmeasured = experiments.runs, experiments.unmeasured_runs
    flags = tuple(_not_used(f"dry run {name}", why) for name, why in unmeasured.items())
    if not runs:
        why = f"{_listed('dry run', list(unmeasured))} not used" if unmeasured else "no dry run"
        return _Crank(None, assumed_arm(robot, origin, why), flags)
    fit, refused = _believed_fit(runs, robot, workers)
    flags = (*flags, *(_not_used(f"dry run {name}", doubt) for name, doubt in refused.items()))
    whole = _listed("dry run", [trial.name for trial in fit.trials])
    doubt = doubt_of_arm(fit)
    if doubt is not None:
        flags = (*flags, _not_used(f"the crank arm of {whole}", doubt))
    if doubt is not None or len(refused) == len(runs):
        return _Crank(fit, assumed_arm(robot, origin, f"{whole} not used"), flags)
    return _Crank(fit, measured_arm(fit), (*flags, *fit.flags))


def _believed_fit(runs: Sequence[DryTrial], robot: RobotSpec, workers: int) -> tuple[CrankFit, dict[str, str]]:
    """The fit of the runs that are believed, of all where none is, and why the others are not.

    A wrong run makes the fit of the others poor as well, so the worst goes first and the rest is asked again.
    """
    response = crank_response(runs, robot, workers=workers)
    fit = whole = fit_crank(runs, robot, response=response, workers=workers)
    refused: dict[str, str] = {}
    while doubts := {trial.name: doubt for trial in fit.trials if (doubt := doubt_of_run(trial))}:
        worst = max((trial for trial in fit.trials if trial.name in doubts), key=_misfit)
        refused[worst.name] = doubts[worst.name]
        left = [run for run in runs if run.name not in refused]
        if not left:
            return whole, refused
        fit = fit_crank(left, robot, response=response, workers=workers)
    return fit, refused


def _misfit(trial: CrankTrial) -> float:
    """How far the twin's motion is off, over the swing of the tail; infinite where the head is not clamped."""
    moves = any(flag.kind == "head_moves" for flag in trial.flags)
    return np.inf if moves else trial.motion_error_m / trial.measured.frequency.amplitude_m


def _not_used(what: str, why: str) -> Flag:
    return Flag("not_used", message=f"{what} is not used: {why}")


def _listed(noun: str, names: list[str]) -> str:
    return f"{noun}{'s' if len(names) > 1 else ''} {', '.join(names)}"
