"""Free decays of the twin: head clamped, in air, no tendons, each released in its own pose and with its own rates."""

from dataclasses import replace

import mujoco
import numpy as np
from mujoco.batch import Batch
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from swimmer import RobotSpec, Scene, build_mjcf
from swimmer.engine import quiet_engine
from swimmer.kinematics import MarkerKinematics
from swimmer.mjcf import FREE_DECAY
from swimmer.twin import PLAUSIBLE_HINGE_RAD
from swimmer.workers import workers_of

STEPS_S = (0.003, 0.0015, 0.00075, 0.000375)  # time steps to choose from
ANGLE_SD_RAD = 0.3  # prior sd of a hinge's angle in a pose: neighbours hold each other back
MARKER_SD_M = 0.003  # boxes sit some millimetres off their markers
DECAY = replace(FREE_DECAY, timestep_s=STEPS_S[0])


def stable_scene(damping_over_stiffness_s: float) -> Scene:
    """Return the longest step that is sure to keep hinges of this damping over stiffness (s) stable.

    The engine steps v' = (v - h w^2 x) / (1 + h w^2 d / k), x' = x + h v': stable for h^2 w^2 < 4 + 2 h w^2 d / k,
    hence at any frequency w for h < 2 d / k; half of that leaves room for a search.
    """
    step_s = next((step_s for step_s in STEPS_S if step_s <= damping_over_stiffness_s), STEPS_S[-1])
    return replace(FREE_DECAY, timestep_s=step_s)


class DecayTwin:
    """Simulator of many decays at once, with the error of the engine's step removed.

    The engine's implicit damping errs in proportion to its step: at 1 ms and the published damping, a fitted stiffness
    would be 0.8 % off. So every decay is simulated with the scene's step and with half of it, and extrapolated to no
    step at all (Richardson 1911), which leaves an error of second order.

    Args:
        robot: the robot.
        markers: names of the m markers wanted.
        scene: head clamped in air without tendons; its time step.
        workers: threads; 0 for all cores.
    """

    def __init__(self, robot: RobotSpec, markers: tuple[str, ...], scene: Scene = DECAY, workers: int = 0) -> None:
        self.hinges = len(robot.hinges)
        self._step_s, self._workers = scene.timestep_s, workers_of(workers)
        halved = replace(scene, timestep_s=scene.timestep_s / 2)
        self._models = [build_mjcf(robot, scene=each).compile() for each in (scene, halved)]
        self._kinematics = MarkerKinematics(robot, markers)
        joints = [self._models[0].joint(name) for name in robot.hinges]
        self._joint = [joint.id for joint in joints]
        self._dof = [int(joint.dofadr[0]) for joint in joints]
        self._batches: dict[tuple[int, int], Batch] = {}

    def __call__(
        self, stiffness_n_m: np.ndarray, damping_n_m_s: np.ndarray, start: np.ndarray, time_s: np.ndarray
    ) -> np.ndarray:
        """Return the marker positions of n decays.

        Args:
            stiffness_n_m: (n,) of every hinge, N m/rad.
            damping_n_m_s: (n,) of every hinge, N m s/rad.
            start: (n, 2, h) hinge angles (rad) and rates (rad/s) at time 0.
            time_s: (f,) not before 0, s.

        Returns:
            (n, f, m, 2) in the robot frame, m; nan where a simulation blew up.
        """
        steps = max(int(np.ceil(time_s.max() / self._step_s)), 4)
        coarse = self._roll(0, stiffness_n_m, damping_n_m_s, start, steps)
        fine = self._roll(1, stiffness_n_m, damping_n_m_s, start, 2 * steps)[:, ::2]
        states = 2 * fine - coarse  # (n, steps + 1, h)
        with np.errstate(invalid="ignore"):
            wild = ~(np.abs(states).max(axis=(1, 2)) < 2 * PLAUSIBLE_HINGE_RAD)
        states[wild] = 0.0
        hinges = CubicSpline(self._step_s * np.arange(steps + 1), states, axis=1)(time_s)  # (n, f, h)
        hinges[wild] = np.nan
        return self.markers_at(hinges)

    def markers_at(self, hinges_rad: np.ndarray) -> np.ndarray:
        """Return the marker positions (..., m, 2) in poses (..., h), robot frame, m."""
        return self._kinematics(np.zeros((*hinges_rad.shape[:-1], 3)), hinges_rad)

    def _roll(
        self, which: int, stiffness_n_m: np.ndarray, damping_n_m_s: np.ndarray, start: np.ndarray, steps: int
    ) -> np.ndarray:
        """Return the hinge angles (n, steps + 1, h) with the scene's step (0) or half of it (1)."""
        key = which, len(start)
        if key not in self._batches:
            self._batches[key] = Batch(self._models[which], len(start), self._workers)
        batch = self._batches[key]
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        batch.expand("jnt_stiffness")[:, self._joint] = stiffness_n_m[:, None]
        batch.expand("dof_damping")[:, self._dof] = damping_n_m_s[:, None]
        position, velocity = batch.bind("qpos"), batch.bind("qvel")
        position[:], velocity[:] = 0.0, 0.0
        position[:, self._dof], velocity[:, self._dof] = start[:, 0], start[:, 1]
        with quiet_engine():
            rolled = batch.rollout(steps, record=("qpos",))["qpos"][..., self._dof]
        return np.concatenate([start[:, :1], rolled], axis=1)


def start_pose(twin: DecayTwin, lateral_m: np.ndarray, rest_m: np.ndarray) -> np.ndarray:
    """Return the likeliest hinge angles (h,) that put the markers where they are: a first guess.

    Args:
        twin: twin with the same k markers.
        lateral_m: (k,) in one frame; nan where missing.
        rest_m: (k,) of the straight tail.
    """
    straight = twin.markers_at(np.zeros(twin.hinges))[:, 1]

    def misfit(pose: np.ndarray) -> np.ndarray:
        off = np.nan_to_num(lateral_m - rest_m - (twin.markers_at(pose)[:, 1] - straight))
        return np.concatenate([off / MARKER_SD_M, pose / ANGLE_SD_RAD])

    return np.clip(least_squares(misfit, np.zeros(twin.hinges)).x, -1.5, 1.5)
