"""The sections of the report, one a file, in the order they are printed.

A new section is a file here with `build(context) -> Section | None` and its line below; None leaves it out.
"""

from collections.abc import Callable

from reports.blocks import Section
from reports.context import ReportContext
from reports.sections import (
    coefficients,
    definitions,
    dry_runs,
    free_decay,
    gap,
    motor,
    other_pairs,
    placement,
    posterior,
    provenance,
    residuals,
    speed_errors,
    speed_sweep,
    structure,
    summary,
    tail_beat,
    track_quality,
    trials,
)

SectionBuilder = Callable[[ReportContext], Section | None]

SECTIONS: tuple[SectionBuilder, ...] = (
    summary.build,
    structure.build,
    free_decay.build,
    dry_runs.build,
    motor.build,
    speed_sweep.build,
    speed_errors.build,
    other_pairs.build,
    trials.build,
    residuals.build,
    tail_beat.build,
    coefficients.build,
    posterior.build,
    gap.build,
    placement.build,
    track_quality.build,
    provenance.build,
    definitions.build,
)

__all__ = ["SECTIONS", "SectionBuilder"]
