"""The robot and its models: description, MJCF, twin, elongated body theory. Imports `session` only."""

from swimmer.crank_turn import CrankTurn, Turn
from swimmer.ebt import TailMotion, added_mass_per_length, drag, mean_thrust, steady_speed
from swimmer.engine import ENGINE, check_engine, model_sha256
from swimmer.fluid import PUBLISHED_COEFFICIENTS, FluidCoefficients
from swimmer.kinematics import MarkerKinematics
from swimmer.large_amplitude import TipMotion, mean_thrust_large, steady_speed_large
from swimmer.mjcf import DRY, FREE_DECAY, SWIM, TIMESTEP_S, Scene, build_mjcf
from swimmer.robot import RobotSpec, load_robot
from swimmer.runs import Runs, Trajectories
from swimmer.twin import Twin, simulate_together
from swimmer.workers import workers_of

__all__ = [
    "DRY",
    "ENGINE",
    "FREE_DECAY",
    "PUBLISHED_COEFFICIENTS",
    "SWIM",
    "TIMESTEP_S",
    "CrankTurn",
    "FluidCoefficients",
    "MarkerKinematics",
    "RobotSpec",
    "Runs",
    "Scene",
    "TailMotion",
    "TipMotion",
    "Trajectories",
    "Turn",
    "Twin",
    "added_mass_per_length",
    "build_mjcf",
    "check_engine",
    "drag",
    "load_robot",
    "mean_thrust",
    "mean_thrust_large",
    "model_sha256",
    "simulate_together",
    "steady_speed",
    "steady_speed_large",
    "workers_of",
]
