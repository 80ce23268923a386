"""The figures of the report by name, for notebooks: each shows itself as the value of a cell."""

from reports.blocks import Plot
from reports.context import ReportContext
from reports.sections import SECTIONS


class Gallery(dict[str, Plot]):
    """Every figure of a report, by the name under which its page saves it; those of a trial begin with its name."""

    def __init__(self, context: ReportContext) -> None:
        sections = [section for build in SECTIONS if (section := build(context)) is not None]
        super().__init__({plot.name: plot for section in sections for plot in section.plots})

    def __missing__(self, name: str) -> Plot:
        raise ValueError(f"figure: found {name!r}, expected one of {', '.join(self)}")
