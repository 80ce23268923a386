"""The file `results/report.html`: one self-contained page a session."""

from collections.abc import Sequence
from pathlib import Path

from reports.blocks import Plot
from reports.context import ReportContext
from reports.numbers import counted
from reports.page import render_page
from reports.sections import QUESTIONS, SECTIONS, SectionBuilder
from session.results import write_whole


def write_report(path: Path, context: ReportContext) -> None:
    """Write the report of one session, whole or not at all.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    write_whole(path, render_report(context))


def render_report(context: ReportContext, sections: Sequence[SectionBuilder] = SECTIONS) -> str:
    """Render the report, or some of its sections, as HTML that opens offline, holds its figures, and loads nothing."""
    per_question = [
        (question, [build(context) for build in builders if build in sections]) for question, builders in QUESTIONS
    ]
    built = [(question, [one for one in own if one is not None]) for question, own in per_question]
    calibration, provenance = context.calibration, context.provenance
    fitted, held = (len(context.trials(role)) for role in ("fit", "holdout"))
    trials = f"{counted(fitted, 'trial')} fitted, {held or 'none'} held out"
    return render_page(
        "report.html.j2",
        title=f"{context.session.name} – swimcal report",
        session=context.session.name,
        byline=f"{calibration.robot.name} · {trials} · {provenance.program}, MuJoCo {provenance.mujoco}, "
        f"effort {provenance.effort}, seed {provenance.seed}",
        questions=[(question, own) for question, own in built if own],
    )


def gallery(context: ReportContext, sections: Sequence[SectionBuilder] = SECTIONS) -> dict[str, Plot]:
    """Draw every figure of a report, or of some of its sections, by the name under which its page saves it.

    The names of those of a trial begin with the trial's name.
    """
    built = [section for build in sections if (section := build(context)) is not None]
    return {plot.name: plot for section in built for plot in section.plots}
