"""What torques that follow a law in one hinge do to free decays."""

from typing import ClassVar

import numpy as np

from diagnosis.ground import Ground
from session.session_file import TrialKind
from swimmer.effects import Effect, Parameter, StepForce, StepState
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec

LAWS = ("its angle", "its rate", "the way it turns", "its acceleration")
_SHARE = 0.05  # of what hinges have, by which they are changed
_TURNS_HZ = 4.0  # about which a tail rings: so its stiffness tells its inertia
_LIGHT = 0.05  # of that, what the last hinge carries: more of it, late by a step, would not be stable


class HingeLaws(Effect):
    """Torques in proportion to one thing of one hinge each, N m of its unit.

    In no catalogue: it stands for what is amiss in a hinge, whatever that is.
    """

    name = "hinge_laws"
    family = "structure"
    stage = "tail"
    physics = "A torque in one hinge in proportion to its angle, its rate, the sign of that, or its acceleration."
    source = "Hooke; Newton; Coulomb; d'Alembert."
    seen_in: ClassVar[frozenset[TrialKind]] = frozenset({"free_decay"})

    def __init__(self, robot: RobotSpec, slow_rad_s: np.ndarray) -> None:
        """Of a robot whose dry friction turns within these rates (h,)."""
        self._slow_rad_s = slow_rad_s
        stiffness, damping = robot.tail.hinge_stiffness_n_m, robot.tail.hinge_damping_n_m_s
        rate = 2 * np.pi * _TURNS_HZ
        sizes = stiffness, damping, _SHARE * stiffness, _LIGHT * stiffness / rate**2
        of_law = dict(zip(LAWS, sizes, strict=True))
        self.parameters = tuple(
            Parameter(f"{hinge}: {law}", "1", -1.0, 1.0, _SHARE * size)
            for hinge in robot.hinges
            for law, size in of_law.items()
        )

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        """On the hinges, the last of the joints."""
        if not values.any() or scene.with_tendons:
            return None
        hinges, strength = slice(-len(robot.hinges), None), values.reshape(len(values), -1, len(LAWS))

        def force(state: StepState) -> np.ndarray:
            rate, result = state.velocity[:, hinges], np.zeros_like(state.velocity)
            told = (state.position[:, hinges], rate, np.tanh(rate / self._slow_rad_s), state.acceleration[:, hinges])
            result[:, hinges] = (strength * np.stack(told, axis=-1)).sum(axis=-1)
            return result

        return force


def in_decays(ground: Ground, slow_rad_s: np.ndarray) -> np.ndarray:
    """(r, h, 4) of the numbers of free decays, what torques of one unit do in each hinge by each of `LAWS`."""
    laws = HingeLaws(ground.twin.robot, slow_rad_s)
    sd = np.array([parameter.sd for parameter in laws.parameters])
    steps = np.vstack([np.zeros(len(sd)), np.diag(sd)])
    told = [ring.of_twin(ground.twin, (laws,), steps) for ring in ground.model.rings]  # each (1 + p, 2)
    changes = [np.nan_to_num((each[1:] - each[0]) / sd[:, None]).T for each in told]
    return np.reshape(changes, (ground.model.of_rings, len(ground.twin.robot.hinges), len(LAWS)))
