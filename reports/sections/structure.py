"""The section on the robot and the structure of its twin: what dry experiments measured, what was assumed."""

from fitting.structure import Source
from reports.blocks import Plot, Plots, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.planform import planform_figure
from reports.numbers import MM, in_mm, listed, sentence, significant, with_error

WORDS = {"hinge_stiffness": "hinge stiffness", "hinge_damping": "hinge damping", "crank_arm": "crank arm"}
SHOWN_UNITS = {"m": ("mm", MM), "N m s/rad": ("mN m s/rad", 1000.0)}
COLUMNS = table_head("number | value [± standard error] | unit | taken from")


def build_robot(context: ReportContext) -> Section:
    """Build the section with a sketch of the robot to scale."""
    robot = context.calibration.robot
    planform = Plot(
        planform_figure(robot, context.session.markers),
        "robot",
        f"The robot from above, to scale ({in_mm(robot.length_m, 0)} mm long): rings are the tracked markers, dots the "
        "hinges, the orange lines the tendons.",
    )
    return Section("Robot", "robot-sketch", (Plots((planform,)),))


def build(context: ReportContext) -> Section:
    """Build the section: a row for each number of the structure, then how the crank turns."""
    structure = context.calibration.structure
    rows = (*map(_row, structure.sources), *_turns(context))
    return Section(
        "What the twin is built from",
        "structure",
        (Table(_text(structure.sources), COLUMNS, rows),),
        tuple(sentence(flag.message) for flag in structure.flags if flag.kind == "not_used"),
    )


def _text(sources: tuple[Source, ...]) -> str:
    chain = "Free decays give the hinges, dry runs the crank arm, then the swims the fluid coefficients. "
    missing = [WORDS.get(source.quantity, source.quantity) for source in sources if source.assumed]
    if not missing:
        return chain + "All of it was measured in this session."
    return chain + (
        f"{sentence(listed(missing)).removesuffix('.')} {'was' if len(missing) == 1 else 'were'} not measured in this "
        "session. The fluid coefficients absorb errors of assumed values, as far as they can."
    )


def _row(source: Source) -> tuple[str, ...]:
    unit, scale = SHOWN_UNITS.get(source.unit, (source.unit, 1.0))
    value = scale * source.value
    shown = significant(value) if source.se is None else with_error(value, scale * source.se)
    origin = f"assumed; {source.sentence}" if source.assumed else listed(source.trials)
    return WORDS.get(source.quantity, source.quantity), shown, unit, origin


def _turns(context: ReportContext) -> list[tuple[str, ...]]:
    """Make rows on how the crank turns: as the motor's log has it, evenly elsewhere."""
    logged, even = [trial.name for trial in context.logged if trial.motor.usable], context.even
    rows: list[tuple[str, ...]] = []
    if logged:
        rows.append(("crank angle", "as logged", "", f"motor log of {listed(logged)}"))
    if even:
        rows.append(("crank angle", "even", "", f"assumed: turns evenly at the tail’s own beat in {listed(even)}"))
    return rows
