"""The sections of the report, one a file, in the order they are printed.

A new section is a file here with `build(context) -> Section | None` and its place below; None leaves it out.
"""

from collections.abc import Callable

from reports.blocks import Section
from reports.context import ReportContext
from reports.sections import (
    coefficients,
    definitions,
    dry_runs,
    forecasts,
    free_decay,
    gap,
    motor,
    posterior,
    provenance,
    residuals,
    steering,
    structure,
    summary,
    tail_beat,
    track_quality,
    trials,
)

SectionBuilder = Callable[[ReportContext], Section | None]

DRY_SECTIONS: tuple[SectionBuilder, ...] = (
    structure.build_robot,
    structure.build,
    free_decay.build,
    dry_runs.build,
    motor.build,
)
"""Sections on robot and motor, which a session without a swim trial has as well."""

QUESTIONS: tuple[tuple[str, tuple[SectionBuilder, ...]], ...] = (
    ("", (summary.build,)),  # the first screen
    ("How far off is the twin?", (forecasts.build, trials.build, residuals.build, tail_beat.build)),
    ("How sure are the coefficients?", (posterior.build, coefficients.build)),
    ("What is missing from the twin?", (gap.build,)),
    ("Where can it be steered?", (steering.build,)),
    ("What is known of robot and motor?", DRY_SECTIONS),
    ("Can the tracks be trusted?", (track_quality.build,)),
    ("How was this made?", (provenance.build, definitions.build)),
)
"""The questions of a report in their order, each with the sections that answer it."""

SECTIONS: tuple[SectionBuilder, ...] = tuple(build for _, builders in QUESTIONS for build in builders)

FURTHER: tuple[SectionBuilder, ...] = (trials.build_motions,)
"""Sections for notebooks alone: one or two figures a trial, too many for a page."""

__all__ = ["DRY_SECTIONS", "FURTHER", "QUESTIONS", "SECTIONS", "SectionBuilder"]
