"""Report of a session: its sections in their order, the page they make, and the sections on terms and provenance.

A section is made by a `build_…(context) -> Section | None` in this folder; None leaves it out. A new one needs a place
in `QUESTIONS`.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from fitting.trial import KNOWN_BEATS, SCORED_S
from reports.coefficients import build_coefficients
from reports.context import ReportContext
from reports.dry_experiments import build_dry_runs, build_free_decay
from reports.first_screen import build_summary
from reports.forecasts import build_forecasts
from reports.gap import build_gap
from reports.page import Plot, Points, Section, Table, Terms, render_page, table_head
from reports.posterior import build_posterior
from reports.robot import build_motor, build_robot, build_structure
from reports.steering import build_steering
from reports.swims import build_motions, build_residuals, build_tail_beat, build_trials
from reports.tracks import build_track_quality
from reports.words import counted, sentence, shown
from swimcal.results import write_whole

TERMS = {
    "head frame": "In every frame all markers are rotated so that nose → neck is +x, with the nose as origin; each "
    "frame adds the head's displacement since the frame before. Forward is −x; the robot's right is +y.",
    "marker distance": "Mean distance between measured and simulated marker in the head frame, over unflagged samples "
    f"of the first {SCORED_S:g} s after warm-up (held-out trials: of what follows their known part), aligned at the "
    "first of these frames. “Shape alone”: relative to the nose in every frame.",
    "speed": "Net displacement in the pool along the mean heading for each second: the slope of the nose's path over "
    "the whole beats of the compared frames; forward is positive.",
    "held out": "A held-out trial took no part in any fit. Its frequency, phase and start come from its own first "
    f"{KNOWN_BEATS:g} beats, at most its first half; only the rest is compared.",
    "EBT": "Elongated body theory as published: mean thrust ½ m (⟨hₜ²⟩ − U²⟨hₓ²⟩) with m = ¼ ρ π β d² balances drag "
    "½ ρ c_D S U². h is taken in the frame of the head, where a tail swings farther than in the pool. "
    "“Smoothed” has it in the frame that swims along, as Lighthill does, by a smoothing filter; “large amplitude” also "
    "keeps the angle of the tail tip.",
    "simple rules": "A line and a power law in frequency, and a constant stride (speed in proportion to frequency), "
    "through the speeds of the fit trials.",
    "determined": "The upper end of a coefficient’s 90 % interval is at most 2.5 times the lower, or the interval no "
    "wider than 0.5, and it does not lie at a bound.",
    "extrapolated": "The trial beats slower or faster than every trial that was fitted.",
}


def build_provenance(context: ReportContext) -> Section:
    """Build the section: everything that is needed to make the report again."""
    notes = (Points("About this run", tuple(map(sentence, context.notes))),) if context.notes else ()
    inputs = tuple(sorted(context.provenance.inputs.items()))
    columns = table_head("input | sha256")
    return Section(
        "Provenance",
        "provenance",
        (
            *notes,
            Points("Assumed, not measured in this session", _assumptions(context)),
            Terms(_made_with(context), "Program and settings"),
            Table("Input files, by name in the session folder.", columns, inputs, folded=True),
        ),
    )


def _assumptions(context: ReportContext) -> tuple[str, ...]:
    session = context.session
    structure = [sentence(source.sentence) for source in context.calibration.structure.sources if source.assumed]
    scale = f"The scale of every picture is the nose-neck distance of {shown(session.camera.scale_length_m * 1000)} mm"
    lens = session.camera.calibration
    return (
        *structure,
        f"{scale}; {'lens distortion is not corrected' if lens is None else 'the lens is calibrated'}.",
        "The robot swims level, at the surface, in still water far from walls.",
    )


def _made_with(context: ReportContext) -> tuple[tuple[str, str], ...]:
    made = context.provenance
    return (
        ("program", made.program),
        ("engine", f"MuJoCo {made.mujoco}"),
        ("model sha256", made.model_sha256),
        ("seed", str(made.seed)),
        ("effort", made.effort),
        ("warm-up", f"{context.session.warmup_s:g} s of every trial left out"),
    )


def build_definitions(context: ReportContext) -> Section:  # noqa: ARG001
    """Build the section, which is the same for every session."""
    return Section("What the words mean", "reading", (Terms(tuple(TERMS.items()), "Definitions of the measures"),))


SectionBuilder = Callable[[ReportContext], Section | None]

DRY_SECTIONS: tuple[SectionBuilder, ...] = (
    build_robot,
    build_structure,
    build_free_decay,
    build_dry_runs,
    build_motor,
)
"""Sections on robot and motor, which a session without a swim trial has as well."""

_OF_GAP, _OF_CHANGE = "What is missing from the twin?", "What changed since the reference?"

QUESTIONS: tuple[tuple[str, tuple[SectionBuilder, ...]], ...] = (
    ("", (build_summary,)),  # the first screen
    ("How far off is the twin?", (build_forecasts, build_trials, build_residuals, build_tail_beat)),
    ("How sure are the coefficients?", (build_posterior, build_coefficients)),
    (_OF_GAP, (build_gap,)),
    ("Where can it be steered?", (build_steering,)),
    ("What is known of robot and motor?", DRY_SECTIONS),
    ("Can the tracks be trusted?", (build_track_quality,)),
    ("How was this made?", (build_provenance, build_definitions)),
)
"""The questions of a report in their order, each with the sections that answer it."""

SECTIONS: tuple[SectionBuilder, ...] = tuple(build for _, builders in QUESTIONS for build in builders)

FURTHER: tuple[SectionBuilder, ...] = (build_motions,)
"""Sections for notebooks alone: one or two figures a trial, too many for a page."""


def write_report(path: Path, context: ReportContext) -> None:
    """Write the report of one session, whole or not at all.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    write_whole(path, render_report(context))


def render_report(context: ReportContext, sections: Sequence[SectionBuilder] = SECTIONS) -> str:
    """Render the report, or some of its sections, as HTML that opens offline, holds its figures, and loads nothing."""
    per_question = [
        (_asked(question, context), [build(context) for build in builders if build in sections])
        for question, builders in QUESTIONS
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


def _asked(question: str, context: ReportContext) -> str:
    """Return the question as it is asked of this session: with a reference a diagnosis tells of a change."""
    found = context.diagnosed
    return _OF_CHANGE if question == _OF_GAP and found is not None and found.reference is not None else question


def gallery(context: ReportContext, sections: Sequence[SectionBuilder] = SECTIONS) -> dict[str, Plot]:
    """Draw every figure of a report, or of some of its sections, by the name under which its page saves it.

    The names of those of a trial begin with the trial's name.
    """
    built = [section for build in sections if (section := build(context)) is not None]
    return {plot.name: plot for section in built for plot in section.plots}
