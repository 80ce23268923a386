"""The robot and its models: description, MJCF, twin, elongated body theory. Imports `session` only."""

from swimmer.crank_turn import CrankTurn
from swimmer.fluid import PUBLISHED_COEFFICIENTS, FluidCoefficients
from swimmer.mjcf import Scene, build_mjcf
from swimmer.robot import RobotSpec, load_robot
from swimmer.runs import Runs, Trajectories
from swimmer.twin import Twin

__all__ = [
    "PUBLISHED_COEFFICIENTS",
    "CrankTurn",
    "FluidCoefficients",
    "RobotSpec",
    "Runs",
    "Scene",
    "Trajectories",
    "Twin",
    "build_mjcf",
    "load_robot",
]
