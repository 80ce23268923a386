"""The sections of the report, one a file, in the order they are printed.

A new section is a file here with `build(context) -> Section | None` and its line below; None leaves it out.
"""

from collections.abc import Callable

from reports.blocks import Section
from reports.context import ReportContext
from reports.sections import (
    coefficients,
    definitions,
    provenance,
    speed_sweep,
    summary,
    track_quality,
    trials,
)

SectionBuilder = Callable[[ReportContext], Section | None]

SECTIONS: tuple[SectionBuilder, ...] = (
    summary.build,
    speed_sweep.build,
    trials.build,
    coefficients.build,
    track_quality.build,
    provenance.build,
    definitions.build,
)

__all__ = ["SECTIONS", "SectionBuilder"]
