"""Tendons that rub in their guides."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from swimmer.effects.dry_friction import DryFriction
from swimmer.effects.effect import Effect, Parameter, StepState
from swimmer.effects.step_damping import StepDamping
from swimmer.effects.tendons.path import TendonPath
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec


class TendonFriction(Effect):
    """Each line loses `force` of its pull at each guide that it slides through; it ends in the last one.

    How far a line slides through a guide is how much longer its way behind it has become, so friction at every guide
    that it has passed before hinge j resists the hinge with the line's arm there: 2 force (j - 1) arm_j for both lines.
    That counts every guide against every hinge: exact where the lines slide the same way in all guides, as in the
    tail's own S-bend. There is no guide before the first hinge.
    """

    name = "tendon_friction"
    family = "tendons"
    stage = "tail"
    physics = "Coulomb friction in the guides: the pull falls from guide to guide, and the rear of the tail lags."
    source = "Coulomb (1785), of constant force where Euler's capstan has one in proportion to the pull."
    seen_in = frozenset({"dry", "swim"})
    parameters = (Parameter("force", "N", 0.0, 5.0, 0.5),)

    def damping(
        self, robot: RobotSpec, scene: Scene, models: Sequence[mujoco.MjModel], values: np.ndarray
    ) -> Callable[[StepState], StepDamping] | None:
        """Dry friction of the hinges."""
        if not values.any() or not scene.with_tendons:
            return None
        arms_m = np.abs(TendonPath(robot).straight().per_hinge[0]).mean(axis=0)
        return DryFriction(2 * values * np.arange(len(arms_m)) * arms_m)


EFFECT = TendonFriction()
