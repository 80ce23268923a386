"""The two numbers of a robot that a free decay tells: stiffness and damping, alike in all its hinges."""

import numpy as np

from swimmer import RobotSpec


def hinges_of(robot: RobotSpec) -> np.ndarray:
    """(2,) stiffness (N m/rad) and damping (N m s/rad)."""
    return np.array([robot.tail.hinge_stiffness_n_m, robot.tail.hinge_damping_n_m_s])


def with_hinges(robot: RobotSpec, stiffness_n_m: float, damping_n_m_s: float) -> RobotSpec:
    """The robot with these, N m/rad and N m s/rad."""
    told = {"hinge_stiffness_n_m": float(stiffness_n_m), "hinge_damping_n_m_s": float(damping_n_m_s)}
    return robot.model_copy(update={"tail": robot.tail.model_copy(update=told)})
