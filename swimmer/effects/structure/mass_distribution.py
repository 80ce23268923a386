"""Mass that sits further back than described."""

import numpy as np

from swimmer.effects.effect import Effect, Parameter
from swimmer.robot import RobotSpec


class MassDistribution(Effect):
    """A `share` of the head's mass belongs to the tail, where it is spread as the tail's own; the total stays."""

    name = "mass_distribution"
    family = "structure"
    stage = "tail"
    physics = "Glue, guides, markers and lines weigh on the tail what a balance has told of the whole robot alone."
    source = "Newton's second law; the tail's mass follows from volume and density alone, 35 g of 1.4 kg."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("share", "1", 0.0, 0.1, 0.01),)

    def robot(self, robot: RobotSpec, values: np.ndarray) -> RobotSpec:
        """Lighter parts in the head, denser ones in the tail."""
        share = float(values[0])
        if share == 0:
            return robot
        moved_kg = share * sum(part.mass_kg for part in robot.head.part)
        heavier = 1 + moved_kg / _tail_kg(robot)
        part = tuple(p.model_copy(update={"mass_kg": p.mass_kg * (1 - share)}) for p in robot.head.part)
        tail, fin = robot.tail, robot.caudal_fin
        return robot.model_copy(
            update={
                "head": robot.head.model_copy(update={"part": part}),
                "tail": tail.model_copy(update={"density_kg_m3": tail.density_kg_m3 * heavier}),
                "caudal_fin": fin.model_copy(update={"mass_kg": fin.mass_kg * heavier}),
            }
        )


def _tail_kg(robot: RobotSpec) -> float:
    volume_m3 = sum(s.length_m * s.thickness_m * 2 * s.half_height_m for s in robot.tail.segment)
    return float(volume_m3 * robot.tail.density_kg_m3 + robot.caudal_fin.mass_kg)


EFFECT = MassDistribution()
