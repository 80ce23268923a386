"""Results of a pipeline whose stages are up to date."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from calib.pipeline import Pipeline
from calib.results.figures import FitFigures, GapFigures, PosteriorFigures
from calib.results.fit import FitResult
from calib.results.gap import EffectTest, GapResult
from calib.results.posterior import PosteriorResult
from calib.results.structure import StructureResult
from calib.results.tracks import TrackResult
from calib.stages.diagnosis import DiagnosisStage
from calib.stages.evidence import EvidenceStage
from diagnosis.result import SUPPOSITION, SuppositionResult
from reports import Diagnosed, ReportContext, gallery
from reports.blocks import Plot
from reports.sections import SECTIONS, gap, posterior
from reports.sections.gap_plots import gap_plots
from session import FaultCollector
from session.stage import Stage

_OF_FIT = tuple(build for build in SECTIONS if build not in (posterior.build, gap.build))
Draw = Callable[[], Mapping[str, Plot]]


def fit_result(pipeline: Pipeline) -> FitResult:
    """The fit that stands."""
    stage = pipeline.the_fit()

    def draw() -> Mapping[str, Plot]:
        return gallery(_context(pipeline), _OF_FIT)

    figures = FitFigures(_while_current(stage, draw))
    return FitResult(
        pipeline.session, stage.name, stage.file, stage.mjcf_file, stage.result(), figures, *_said(pipeline)
    )


def posterior_result(pipeline: Pipeline) -> PosteriorResult:
    """The posterior of the fit that stands."""
    fit = pipeline.the_fit()
    stage = pipeline.posteriors(fit)
    found = stage.read()
    assert found is not None

    def draw() -> Mapping[str, Plot]:
        return gallery(replace(_context(pipeline), posterior=found), (posterior.build,))

    figures = PosteriorFigures(_while_current(stage, draw))
    name = f"posterior of {stage.effort} effort of the {fit.name}"
    return PosteriorResult(pipeline.session, name, stage.file, found, figures, *_said(pipeline))


def gap_result(pipeline: Pipeline, stage: DiagnosisStage) -> GapResult:
    """A diagnosis."""
    found = stage.read()

    def draw() -> Mapping[str, Plot]:
        return gap_plots(Diagnosed(found, stage.effort), pipeline.robot, pipeline.session.markers)

    figures, name = GapFigures(_while_current(stage, draw)), f"diagnosis of {stage.effort} effort"
    return GapResult(pipeline.session, name, stage.file, found, figures, *_said(pipeline))


def test_result(pipeline: Pipeline, found: SuppositionResult) -> EffectTest:
    """What the swim trials say of effects."""
    return EffectTest(pipeline.session, pipeline.session.results / SUPPOSITION.name, found, *_said(pipeline))


def structure_result(pipeline: Pipeline) -> StructureResult:
    """What the dry experiments say."""
    name, file = "no swim to fit; the dry experiments alone", pipeline.structures.file
    return StructureResult(pipeline.session, name, file, pipeline.structure, *_said(pipeline))


def track_result(pipeline: Pipeline) -> TrackResult:
    """The tracks of all trials that a camera saw."""
    recordings = pipeline.recordings
    tracked = recordings.recorded
    measured = {trial.name: trial for trial in recordings.swims} if recordings.has_swims else {}
    flags = {name: measured[name].flags if name in measured else found.flags for name, found in tracked.items()}
    return TrackResult(pipeline.session, tracked, measured, flags, _said(pipeline)[0])


def _context(pipeline: Pipeline) -> ReportContext:
    fit = pipeline.the_fit()
    provenance = replace(pipeline.job.provenance, effort=fit.effort)
    evidence = EvidenceStage(pipeline.job, fit).read()
    return ReportContext(pipeline.session, fit.read(), provenance, pipeline.notes, evidence=evidence)


def _while_current(stage: Stage, draw: Draw) -> Draw:
    """Draws as long as the result that is drawn still stands.

    Raises:
        InputError: it was replaced.
    """

    def drawn() -> Mapping[str, Plot]:
        if not stage.is_current:
            faults = FaultCollector(str(stage.file))
            next_step = "Ask for the result again, then for its figures."
            faults.add("", "another result stands there now", next_step=next_step)
            faults.raise_if_any()
        return draw()

    return drawn


def _said(pipeline: Pipeline) -> tuple[tuple[str, ...], tuple[Path, ...]]:
    """What was said, and the files that were made."""
    return (*pipeline.said, *pipeline.notes), tuple(pipeline.made)
