"""What a robot may do that its twin leaves out, as `calib benchmark posterior --effect` puts it in."""

from typing import Literal, NamedTuple, get_args

import numpy as np

from swimmer import RobotSpec

Effect = Literal["none", "hinge_stiffness", "hinge_damping", "crank_arm", "current", "any"]
"""Hinges 15 % stiffer, or damped twice as much; a crank arm 5 % shorter; a current; any of these, in turn by seed."""
EFFECTS: tuple[Effect, ...] = get_args(Effect)[1:-1]
CURRENT_M_S = 0.02
_STIFFER, _DAMPED, _ARM = 1.15, 2.0, 0.95


class Unmodelled(NamedTuple):
    """What a swim has and the twin has not: a robot that differs, and a current (2,) that carries it, m/s."""

    robot: RobotSpec
    current_m_s: np.ndarray


def effect_of(effect: Effect, seed: int) -> Effect:
    """The effect itself, with "any" resolved."""
    return EFFECTS[seed % len(EFFECTS)] if effect == "any" else effect


def with_effect(robot: RobotSpec, effect: Effect, random: np.random.Generator) -> Unmodelled:
    """The robot that swims, and the current that it swims in, of random direction.

    Args:
        robot: as the twin knows it.
        effect: one of them, or "none".
        random: for the direction.
    """
    angle = random.uniform(0.0, 2 * np.pi)
    current_m_s = np.zeros(2)
    if effect == "hinge_stiffness":
        robot = _with_tail(robot, hinge_stiffness_n_m=_STIFFER * robot.tail.hinge_stiffness_n_m)
    elif effect == "hinge_damping":
        robot = _with_tail(robot, hinge_damping_n_m_s=_DAMPED * robot.tail.hinge_damping_n_m_s)
    elif effect == "crank_arm":
        crank = robot.crank.model_copy(update={"arm_m": _ARM * robot.crank.arm_m})
        robot = robot.model_copy(update={"crank": crank})
    elif effect == "current":
        current_m_s = CURRENT_M_S * np.array([np.cos(angle), np.sin(angle)])
    return Unmodelled(robot, current_m_s)


def _with_tail(robot: RobotSpec, **changes: float) -> RobotSpec:
    return robot.model_copy(update={"tail": robot.tail.model_copy(update=changes)})
