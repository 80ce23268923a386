"""Results made from a pipeline whose stages are up to date."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any, cast

from calib.pipeline import Pipeline
from calib.results.fit import FitResult, StructureResult
from calib.results.gap import EffectTest, GapResult, PosteriorResult
from calib.results.result import FitFigures, GapFigures, PosteriorFigures, StructureFigures, check_current
from calib.results.tracks import FilmedTracks, TrackResult
from calib.stages.diagnosis import DiagnosisStage
from calib.stages.fit import PosteriorStage
from diagnosis.result import EFFECT_TEST, EffectTestResult
from fitting.calibration import CalibratedTrial, Calibration
from fitting.calibration_file import PublishedResult
from fitting.left_out import left_out_flags
from fitting.trial import MeasuredTrial
from reports.caveats import explained_kinds
from reports.context import NoSwims, ReportContext
from reports.first_screen import build_summary
from reports.gap import build_gap, gap_plots
from reports.page import Plot
from reports.posterior import build_posterior
from reports.report import DRY_SECTIONS, FURTHER, SECTIONS, gallery
from reports.swims import trial_plots
from reports.words import in_words, listed
from swimcal.errors import NotEnoughData

_NOT_OF_FIT = (build_posterior, build_gap)
_OF_FIT = tuple(build for build in SECTIONS if build not in _NOT_OF_FIT)


def fit_result(pipeline: Pipeline) -> FitResult:
    """Make the result of the current fit."""
    stage = pipeline.the_fit()
    data = stage.result()

    def read() -> Calibration:
        check_current(stage)
        return stage.read()

    def read_trial(name: str) -> CalibratedTrial:
        check_current(stage)
        return stage.read_trial(name)

    def draw_trial(name: str) -> Mapping[str, Plot]:
        return trial_plots(read_trial(name), stage.robot)

    figures = FitFigures(
        stage, lambda: gallery(_context(pipeline), (*_OF_FIT, *FURTHER)), draw_trial, tuple(data.trials)
    )

    posterior, diagnosis = pipeline.current_posterior(stage), pipeline.current_diagnosis()
    return FitResult(
        name=stage.name,
        file=stage.file,
        mjcf_file=stage.mjcf_file,
        data=data,
        published=_read_published(pipeline),
        plot=figures,
        read=read,
        read_trial=read_trial,
        posterior=None if posterior is None else posterior.read(draws=False),
        diagnosed=None if diagnosis is None else diagnosis.read(),
        standing=pipeline.standing,
        damaged=pipeline.damaged,
        **_common(pipeline),
    )


def posterior_result(pipeline: Pipeline, stage: PosteriorStage) -> PosteriorResult:
    """Make the result of a posterior of the current fit."""
    fit, found = pipeline.the_fit(), stage.read()
    assert found is not None
    sections = (build_summary, build_posterior)
    figures = PosteriorFigures(stage, lambda: gallery(replace(_context(pipeline), posterior=found), sections))
    name = f"posterior of {stage.effort} effort of the {fit.name}"
    diagnosis = pipeline.current_diagnosis()
    return PosteriorResult(
        name=name,
        file=stage.file,
        data=found,
        plot=figures,
        next_step=_next_step(pipeline),
        explained=explained_kinds(None if diagnosis is None else diagnosis.read()),
        **_common(pipeline),
    )


def gap_result(pipeline: Pipeline, stage: DiagnosisStage) -> GapResult:
    """Make the result of a diagnosis."""
    found, robot, markers = stage.read(), pipeline.job.robot, pipeline.session.markers
    figures = GapFigures(stage, lambda: gap_plots(found, robot, markers))
    name = f"diagnosis of {stage.effort} effort"
    step = _next_step(pipeline)
    return GapResult(name=name, file=stage.file, data=found, plot=figures, next_step=step, **_common(pipeline))


def test_result(pipeline: Pipeline, found: EffectTestResult) -> EffectTest:
    """Make the result of a test of effects."""
    name = f"test of {listed([in_words(effect) for effect in found.effects])}"
    return EffectTest(name=name, file=pipeline.session.results / EFFECT_TEST.name, data=found, **_common(pipeline))


def structure_result(pipeline: Pipeline) -> StructureResult:
    """Make the result of the dry experiments."""
    name, found, common = "no swim trial to fit; the dry experiments alone", pipeline.structure, _common(pipeline)
    context = ReportContext(pipeline.session, cast(Calibration, NoSwims(found)), pipeline.job.provenance)
    figures = StructureFigures(pipeline.structures, lambda: gallery(context, DRY_SECTIONS))
    return StructureResult(name=name, file=pipeline.structures.file, data=found, plot=figures, **common)


def track_result(pipeline: Pipeline, filmed: FilmedTracks) -> TrackResult:
    """Make the result of the tracks of all trials that a camera saw; trials that cannot be measured are flagged."""
    recordings = pipeline.recordings
    left_out = {**recordings.left_out, **filmed.left_out}
    measured: dict[str, MeasuredTrial] = {}
    with suppress(NotEnoughData):
        measured = {trial.name: trial for trial in recordings.swims}
    tracked = recordings.recorded
    flags = {name: measured[name].flags if name in measured else found.flags for name, found in tracked.items()}
    for name, why in left_out.items():
        flags[name] = (*flags.get(name, ()), *left_out_flags({name: why}))
    notes = (*_common(pipeline)["notes"], *(f"trial {name}: {why}" for name, why in left_out.items()))
    return TrackResult(pipeline.session, tracked, measured, flags, filmed, notes)


def _next_step(pipeline: Pipeline) -> str:
    """Name the next step after a posterior or a diagnosis: what is out of date first, then that of the answers."""
    session = pipeline.session
    if pipeline.current_diagnosis() is None:
        return f"calib diagnose {session.in_shell}"
    if pipeline.current_report() is None:
        old = (session.results / "report.html").is_file()
        return f"{'the report is out of date: ' if old else ''}calib report {session.in_shell}"
    return fit_result(pipeline).answers.next_step


def _context(pipeline: Pipeline) -> ReportContext:
    fit = pipeline.the_fit()
    provenance = replace(pipeline.job.provenance, effort=fit.effort)
    return ReportContext(pipeline.session, fit.read(), provenance, pipeline.recordings.notes, _read_published(pipeline))


def _read_published(pipeline: Pipeline) -> PublishedResult | None:
    stage = pipeline.current_published()
    return None if stage is None else stage.read()


def _common(pipeline: Pipeline) -> dict[str, Any]:
    """Collect what all results have: the session, the notes, and the files that were made."""
    notes = (*pipeline.notes, *pipeline.recordings.notes)
    return {"session": pipeline.session, "notes": notes, "made": tuple(pipeline.made)}
