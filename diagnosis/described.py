"""How closely a robot follows its description before it counts as another robot: departures within are no effect."""

from diagnosis.constants import WITHIN
from fitting.model.robot_uncertainty import ParameterUncertainty, PerturbedTwin, perturbed_twins
from fitting.structure import Source, assumed
from swimmer import RobotSpec, Twin

_STEP = 0.05  # of mass, either way


def perturbed_robots(twin: Twin) -> tuple[PerturbedTwin, ...]:
    """Twins on either side of the description, for all that a robot may differ by and still be as described."""
    sources = [source for source in assumed(twin.robot).sources if source.value > 0]
    doubted = perturbed_twins(twin, [ParameterUncertainty(source, WITHIN[source.quantity]) for source in sources])
    mass = ParameterUncertainty(_mass(twin.robot), WITHIN["mass"])
    for heavier in (_heavier_head, _heavier_tail):
        more, less = (twin.of_robot(heavier(twin.robot, by)) for by in (_STEP, -_STEP))
        doubted = (*doubted, PerturbedTwin(mass, more, less, _STEP))
    return doubted


def _mass(robot: RobotSpec) -> Source:
    kg = sum(part.mass_kg for part in robot.head.part)
    return Source("mass", kg, "kg", None, (), "as described")


def _heavier_head(robot: RobotSpec, by: float) -> RobotSpec:
    part = tuple(p.model_copy(update={"mass_kg": p.mass_kg * (1 + by)}) for p in robot.head.part)
    return robot.model_copy(update={"head": robot.head.model_copy(update={"part": part})})


def _heavier_tail(robot: RobotSpec, by: float) -> RobotSpec:
    tail, fin = robot.tail, robot.caudal_fin
    return robot.model_copy(
        update={
            "tail": tail.model_copy(update={"density_kg_m3": tail.density_kg_m3 * (1 + by)}),
            "caudal_fin": fin.model_copy(update={"mass_kg": fin.mass_kg * (1 + by)}),
        }
    )
