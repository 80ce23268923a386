"""Functions that compute: fit, posterior, diagnosis, the test of an effect, and the whole chain."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from calib.given import AnySession, compute_elsewhere, folder_of, list_folders, working_on
from calib.kept_output import keep_output
from calib.options import EffortName, LastStepName, ObjectiveName, Options
from swimcal.errors import Fault, InputError
from swimcal.session import Session

if TYPE_CHECKING:
    from calib.pipeline import Pipeline
    from calib.results.fit import FitResult, StructureResult
    from calib.results.gap import EffectTest, GapResult, PosteriorResult
    from calib.results.result import Export
    from swimcal.effects.effect import Effect


def run(
    sessions: AnySession | Sequence[AnySession],
    effort: EffortName | None = None,
    *,
    until: LastStepName = "diagnosis",
    jobs: int = 1,
    workers: int = 0,
    scheduler: str | None = None,
    progress: bool = True,
) -> FitResult | StructureResult | Export:
    """Run every stage a session has data for, then write the report.

    The stages are tracks, fit, MJCF, posterior and diagnosis.

    Args:
        sessions: one, or several: then a session that fails stops no other.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        until: the last step before the report: "fit", "posterior" or "diagnosis".
        jobs: sessions at a time, each in a process of its own.
        workers: threads of each session; 0 for its share of the cores, one with a scheduler.
        scheduler: address of a dask scheduler, whose workers run the sessions; they need to see the same folders.
        progress: show the progress on standard error.

    Returns:
        The fit, or what the dry experiments alone determine; for several sessions, or with a scheduler, their reports
        and the index, as `report`.

    Raises:
        InputError, NotEnoughData, SimulationDiverged: as `fit`, of a single session. Draws that did not converge are
            only reported in `notes`.
        InputError: no scheduler answers, or a worker has another version of the program or the engine.

    Example:
        >>> calib.run("pool", "quick", progress=False).file.name
        'calibration.json'
    """
    from calib.batch import index_sessions, run_all, run_pipeline

    if until not in get_args(LastStepName):
        raise InputError([Fault("until", "", "no such step", repr(until), "", get_args(LastStepName))])
    options = Options(effort, workers)
    if jobs < 1:
        raise InputError([Fault("jobs", "", "no number of sessions at a time", str(jobs), "1 or more")])
    if isinstance(sessions, Session | str | Path):
        if scheduler is None:
            with working_on(sessions, options, progress) as pipeline:
                run_pipeline(pipeline, until)
                keep_output(pipeline)
                return _result_of_fit(pipeline)
        sessions = [sessions]
    folders = list_folders(sessions)
    return index_sessions(
        folders, None, run_all(folders, effort, jobs, workers, progress, scheduler, partial(run_pipeline, until=until))
    )


def fit(
    session: AnySession,
    effort: EffortName | None = None,
    *,
    workers: int = 0,
    objective: ObjectiveName = "likelihood",
    progress: bool = True,
    scheduler: str | None = None,
) -> FitResult | StructureResult:
    """Fit the five fluid coefficients, with hinges, crank, frequencies, phases and elongated body theory; forecast.

    The coefficients are the mode of a hierarchical model of the fit trials, which also has what differs from
    trial to trial (trim, registration of the head frame, boxes, start) and a model discrepancy over frequency. Every
    held-out trial is forecast by the twin alone, given the frequency, and after its first two beats; compared with a
    line, a power law and a constant stride through the fitted speeds, and the continuation of its first two beats.

    Free decays give stiffness and damping of the hinges; dry runs then give the crank arm. What was not recorded
    is assumed to be as the robot is described. A previous fit is kept in `results/kept`.

    Args:
        session: an opened session, or its folder.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        scheduler: address of a dask scheduler, one of whose workers computes; it needs to see the same folder.
        objective: "published" also runs the published search (Bayesian optimisation, then Nelder-Mead, of the mean
            marker distance) and keeps it next to the fit, for comparison; it takes minutes.

    Returns:
        The fit; for a session without a swim trial what the dry experiments alone determine.

    Raises:
        InputError, NotEnoughData, SimulationDiverged: what keeps trials from being fitted, all at once.

    Source:
        Kennedy and O'Hagan (2001), calibration with a discrepancy; Patterson and Thompson (1971), restricted
        likelihood. Michelis et al. (2026), "Simple Models, Real Swimming": crank grid search, head frame.

    Example:
        >>> found = calib.fit("pool", "quick", progress=False)
        >>> list(found.to_frame().index)
        ['slow', 'fast']
    """
    work = partial(_fit, objective=objective)
    compute_elsewhere(scheduler, session, effort, work)
    with working_on(session, Options(effort, workers), progress) as pipeline:
        work(pipeline)
        keep_output(pipeline)
        return _result_of_fit(pipeline)


def posterior(
    session: AnySession,
    effort: EffortName | None = None,
    *,
    workers: int = 0,
    progress: bool = True,
    scheduler: str | None = None,
) -> PosteriorResult:
    """Sample the posterior of the five coefficients given the fit trials; fit first where there is no fit.

    Args:
        session: an opened session, or its folder.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        scheduler: address of a dask scheduler, one of whose workers computes; it needs to see the same folder.

    Raises:
        NotConverged: draws that must not be relied on; none are reported.
        InputError, NotEnoughData, SimulationDiverged: as `fit`.

    Source:
        Goodman and Weare (2010), affine-invariant ensemble sampler, by emcee.

    Example:
        >>> list(calib.posterior("pool", "quick", progress=False).to_frame("coefficients").index)[:2]
        ['blunt_drag', 'slender_drag']
    """
    from calib.pipeline import Pipeline
    from calib.results.made import posterior_result

    compute_elsewhere(scheduler, session, effort, Pipeline.posterior)
    with working_on(session, Options(effort, workers), progress) as pipeline:
        stage = pipeline.posterior()
        keep_output(pipeline)
        return posterior_result(pipeline, stage)


def diagnose(
    session: AnySession,
    effort: EffortName | None = None,
    *,
    exclude: Iterable[str] = (),
    effects: Iterable[str | Effect] | None = None,
    reference: AnySession | None = None,
    workers: int = 0,
    progress: bool = True,
    scheduler: str | None = None,
) -> GapResult:
    """Locate the sim-to-real gap, rank its likely causes, and measure how far it shrinks with the named effects.

    Args:
        session: an opened session, or its folder.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        scheduler: address of a dask scheduler, one of whose workers computes; it needs to see the same folder.
        exclude: names of effects that the catalogue is to lack.
        effects: the catalogue of this diagnosis: names, or effects of your own; default: all.
        reference: a session of the same robot, camera and water, filmed before something changed: the effects are then
            those of the change. It is fitted first where it has no fit.

    Raises:
        InputError: no effect of this name; a reference of another robot or camera; or as `fit`.
        NotEnoughData: no swim trial has the role "fit".
        SimulationDiverged: the plain twin, from every start.

    Example:
        >>> gap = calib.diagnose("pool", "quick", progress=False)
        >>> round(sum(gap.where.by_stage.values()), 6)
        1.0
    """
    from calib.pipeline import Pipeline
    from calib.results.made import gap_result
    from calib.stages.diagnosis import check_names
    from swimcal.effects.catalogue import catalogue
    from swimcal.effects.effect import Effect

    asked = list(catalogue().values()) if effects is None else list(effects)
    own = tuple(effect for effect in asked if isinstance(effect, Effect))
    named = {effect.name if isinstance(effect, Effect) else effect for effect in asked}
    check_names("effects", sorted(named), dict(catalogue()) | {effect.name: effect for effect in own})
    without = frozenset(exclude) | (frozenset(catalogue()) - named)
    further = tuple(each for each in own if each.name not in catalogue())
    healthy = None if reference is None else folder_of(reference)
    work = partial(Pipeline.diagnosis, without=without, own=further, reference=healthy)
    compute_elsewhere(scheduler, session, effort, work)
    with working_on(session, Options(effort, workers), progress) as pipeline:
        stage = pipeline.diagnosis(without, own=further, reference=healthy)
        keep_output(pipeline)
        return gap_result(pipeline, stage)


def effect_test(
    session: AnySession,
    effects: Iterable[str],
    effort: EffortName | None = None,
    *,
    workers: int = 0,
    progress: bool = True,
) -> EffectTest:
    """Test some effects of the catalogue together: log Bayes factor over the plain twin; computed anew every time.

    Args:
        session: an opened session, or its folder.
        effects: names of the effects.
        effort: "quick" or "full"; default: as `diagnose`.
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.

    Raises:
        InputError, NotEnoughData, SimulationDiverged: as `diagnose`.

    Example:
        >>> found = calib.effect_test("pool", ["camera_parallax"], "quick", progress=False)
        >>> found.log_bayes_factor < 0              # the trials are against it
        True
    """
    from calib.results.made import test_result

    with working_on(session, Options(effort, workers), progress) as pipeline:
        return test_result(pipeline, pipeline.effect_test(tuple(effects)))


def _fit(pipeline: Pipeline, objective: ObjectiveName) -> None:
    if pipeline.only_dry:
        pipeline.structured()
        return
    pipeline.fit()
    if objective == "published":
        pipeline.published()


def _result_of_fit(pipeline: Pipeline) -> FitResult | StructureResult:
    from calib.results.made import fit_result, structure_result

    return structure_result(pipeline) if pipeline.only_dry else fit_result(pipeline)
