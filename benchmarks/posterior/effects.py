"""What a robot may do that its twin leaves out, as `calib benchmark posterior --effect` puts it in."""

from dataclasses import dataclass

import numpy as np

from benchmarks.posterior.effect_names import EFFECTS, Effect
from swimmer import RobotSpec, Runs, Scene, Trajectories, Twin
from swimmer.effects import AffectedRuns, AffectedTwin, catalogue

CURRENT_M_S = 0.02
_STIFFER, _DAMPED, _SHORTER = 0.15, 1.0, 0.05
_OF_CATALOGUE = {"entrained_water": (0.004,), "tendon_compliance": (4.0,), "segment_coefficients": (0.6, -0.6)}


@dataclass(frozen=True, eq=False)
class Unmodelled:
    """What a swim has and the twin has not."""

    robot: RobotSpec  # that differs
    current_m_s: np.ndarray  # (2,) that carries it, m/s
    effect: str | None = None  # name of an effect of the catalogue that acts; None for none
    strength: float = 1.0  # of that effect, in shares of its full strength

    def twin(self, robot: RobotSpec, markers: tuple[str, ...], scene: Scene) -> Twin:
        """The simulator of the swims."""
        plain = Twin(robot, markers, scene)
        return plain if self.effect is None else _Acting(plain, self.effect, self.strength)


class _Acting(AffectedTwin):
    """A twin on which an effect of the catalogue acts in every run."""

    def __init__(self, plain: Twin, effect: str, strength: float) -> None:
        super().__init__(plain, [catalogue()[effect]])
        self._acting = strength * np.array(_OF_CATALOGUE[effect])

    def simulate(self, runs: Runs, time_s: np.ndarray, *, allow_divergence: bool = False) -> Trajectories:
        """With the effect."""
        own = AffectedRuns(**vars(runs), values=np.tile(self._acting, (len(runs), 1)))
        return super().simulate(own, time_s, allow_divergence=allow_divergence)


def effect_of(effect: Effect, seed: int) -> Effect:
    """The effect itself, with "any" resolved."""
    return EFFECTS[seed % len(EFFECTS)] if effect == "any" else effect


def with_effect(robot: RobotSpec, effect: Effect, random: np.random.Generator, strength: float = 1.0) -> Unmodelled:
    """The robot that swims, and the current that it swims in, of random direction.

    Args:
        robot: as the twin knows it.
        effect: one of them, or "none".
        random: for the direction.
        strength: share of the full strength.
    """
    angle = random.uniform(0.0, 2 * np.pi)
    current_m_s = np.zeros(2)
    if effect == "hinge_stiffness":
        robot = _with_tail(robot, hinge_stiffness_n_m=(1 + strength * _STIFFER) * robot.tail.hinge_stiffness_n_m)
    elif effect == "hinge_damping":
        robot = _with_tail(robot, hinge_damping_n_m_s=(1 + strength * _DAMPED) * robot.tail.hinge_damping_n_m_s)
    elif effect == "crank_arm":
        crank = robot.crank.model_copy(update={"arm_m": (1 - strength * _SHORTER) * robot.crank.arm_m})
        robot = robot.model_copy(update={"crank": crank})
    elif effect == "current":
        current_m_s = strength * CURRENT_M_S * np.array([np.cos(angle), np.sin(angle)])
    return Unmodelled(robot, current_m_s, effect if effect in _OF_CATALOGUE else None, strength)


def _with_tail(robot: RobotSpec, **changes: float) -> RobotSpec:
    return robot.model_copy(update={"tail": robot.tail.model_copy(update=changes)})
