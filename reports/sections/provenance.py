"""The section on where the numbers come from: inputs, versions, the robot, and what was assumed, not measured."""

from reports.blocks import Points, Section, Table, Terms, table_head
from reports.context import ReportContext
from reports.numbers import MISSING, sentence, shown, significant


def build(context: ReportContext) -> Section:
    """Build the section: everything that is needed to make the report again."""
    inputs = tuple(sorted(context.provenance.inputs.items()))
    columns = table_head("input | sha256")
    return Section(
        "Provenance",
        "provenance",
        (
            *_notes(context),
            Points("Assumed, not measured in this session", _assumptions(context)),
            Terms(_made_with(context), "Program and settings"),
            Terms(_robot(context), "The robot as described"),
            Table("Input files, by name in the session folder.", columns, inputs, folded=True),
        ),
    )


def _notes(context: ReportContext) -> tuple[Points, ...]:
    return (Points("About this run", tuple(map(sentence, context.notes))),) if context.notes else ()


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


def _robot(context: ReportContext) -> tuple[tuple[str, str], ...]:
    robot, file = context.calibration.robot, context.session.robot_file
    mass_kg = sum(part.mass_kg for part in robot.head.part)
    return (
        ("robot", f"{robot.name} ({'built in' if file is None else file.name})"),
        ("length", f"{significant(robot.length_m * 1000)} mm, nose marker to end of the fin"),
        ("head", f"{significant(mass_kg)} kg"),
        ("tail", f"{len(robot.hinges)} hinges of {significant(robot.tail.hinge_stiffness_n_m)} N m/rad"),
        (
            "tendons",
            f"{significant(robot.tendons.stiffness_n_m / 1000)} kN/m, {robot.tendons.damping_n_s_m:g} N s/m",
        ),
        ("crank arm", f"{significant(robot.crank.arm_m * 1000)} mm"),
        ("water", f"{robot.water.density_kg_m3:g} kg/m³, {robot.water.viscosity_pa_s:g} Pa s"),
        ("markers", ", ".join(context.session.markers) or MISSING),
    )
