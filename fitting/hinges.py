"""Stiffness and damping of the hinges: the twin that rings with them, their fit to one decay, their mean over several.

`DecayTwin` simulates many free decays at once; `fitting.decay_fit` fits it and makes a `DecayFit`. `combine_decays`
averages the fits of several decays, `fault_of_decay` says which of them is not believed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from mujoco.batch import Batch
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.stats import chi2

from fitting.free_decay import DecaySpectrum, DecayTrial
from fitting.lasting_noise import LastingNoise
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.mjcf import FREE_DECAY, Scene, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.runs import MarkerKinematics, quiet_engine, workers_of
from swimcal.twin import PLAUSIBLE_HINGE_RAD

# The twin of a free decay
STEPS_S = (0.003, 0.0015, 0.00075, 0.000375)  # time steps to choose from
ANGLE_SD_RAD = 0.3  # prior sd of a hinge's angle in a pose: neighbours hold each other back
MARKER_SD_M = 0.003  # boxes sit some millimetres off their markers
DECAY = replace(FREE_DECAY, timestep_s=STEPS_S[0])

# The fit and its flags
LEAST_CHANCE = 0.01  # decays disagree if those of one robot are so far apart with less probability
LEAST_EXPLAINED = 0.98  # share of the motion; a tail that decays like the twin leaves tracking errors only
LEAST_SEEN = 0.9  # share of a marker's samples; one that leaves or merges is missing where it swings widest
FARTHEST_RAD = 1.2  # largest angle of a hinge; the published model stops it at 80 degrees (1.4 rad)
MISFIT_M = 0.0015  # rms distance that tracking errors explain, however small the swing
WRONG = ("head_moves", "poor_fit", "not_converged")  # flags of a decay that must not reach the swims
WORST_SE = (0.03, 0.3)  # relative standard errors of stiffness and damping that are worth a flag


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
        extrapolated: whether that is done; without, decays are those of the scene's step, for comparison with others
            of the same step.
    """

    def __init__(
        self,
        robot: RobotSpec,
        markers: tuple[str, ...],
        scene: Scene = DECAY,
        workers: int = 0,
        *,
        extrapolated: bool = True,
    ) -> None:
        self.hinges = len(robot.hinges)
        self._step_s, self._workers = scene.timestep_s, workers_of(workers)
        scenes = [scene, replace(scene, timestep_s=scene.timestep_s / 2)] if extrapolated else [scene]
        self._models = [build_mjcf(robot, scene=each).compile() for each in scenes]
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
        states = self._roll(0, stiffness_n_m, damping_n_m_s, start, steps)  # (n, steps + 1, h)
        if len(self._models) > 1:
            states = 2 * self._roll(1, stiffness_n_m, damping_n_m_s, start, 2 * steps)[:, ::2] - states
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


# The hinges of a robot, as described and as fitted.


def hinges_of(robot: RobotSpec) -> np.ndarray:
    """Return stiffness (N m/rad) and damping (N m s/rad) of a robot's hinges, (2,)."""
    return np.array([robot.tail.hinge_stiffness_n_m, robot.tail.hinge_damping_n_m_s])


def with_hinges(robot: RobotSpec, stiffness_n_m: float, damping_n_m_s: float) -> RobotSpec:
    """Return the robot with these hinges, N m/rad and N m s/rad."""
    stiffness, damping = float(stiffness_n_m), float(damping_n_m_s)
    return robot.changed(tail={"hinge_stiffness_n_m": stiffness, "hinge_damping_n_m_s": damping})


@dataclass(frozen=True, eq=False)
class DecayFit:
    """Fit of the hinges to one free decay.

    Attributes:
        name: name of the trial.
        stiffness_n_m, stiffness_se_n_m: stiffness of every hinge, N m/rad, with its standard error.
        damping_n_m_s, damping_se_n_m_s: damping of every hinge, N m s/rad, with its standard error.
        matched_stiffness_n_m: first estimate, the stiffness whose twin has the same peak and decay.
        spectrum: spectrum of the measured decay.
        noise: noise of the tracks, as the fit found it.
        start_rad: (2, h) hinge angles (rad) and rates (rad/s) in the first frame.
        time_s: (n,) from the first frame after the release, s.
        markers: names of the k markers.
        measured_m, simulated_m: (n, k) lateral motion less the boxes' offsets; nan where it does not count.
        rms_m: root mean square of their difference.
        explained: share of the motion about rest that the twin explains.
        converged: whether the fit settled.
        flags: when not to believe it, those of trial and spectrum among them.
    """

    name: str
    stiffness_n_m: float
    stiffness_se_n_m: float
    damping_n_m_s: float
    damping_se_n_m_s: float
    matched_stiffness_n_m: float
    spectrum: DecaySpectrum
    noise: LastingNoise
    start_rad: np.ndarray
    time_s: np.ndarray
    markers: tuple[str, ...]
    measured_m: np.ndarray
    simulated_m: np.ndarray
    rms_m: float
    explained: float
    converged: bool
    flags: tuple[Flag, ...]


@dataclass(frozen=True)
class HingeEstimate:
    """Stiffness (N m/rad) and damping (N m s/rad) of every hinge, with their standard errors."""

    stiffness_n_m: float
    stiffness_se_n_m: float
    damping_n_m_s: float
    damping_se_n_m_s: float
    decays: int
    flags: tuple[Flag, ...] = ()


def combine_decays(fits: Sequence[DecayFit]) -> HingeEstimate:
    """Return the weighted geometric mean of several decays.

    Where they scatter by more than their standard errors say, the combined ones grow by as much (Birge 1932).

    Raises:
        NotEnoughData: no decay.
    """
    if not fits:
        raise NotEnoughData("no free decay to take the stiffness from; expected at least one")
    values = np.array([(fit.stiffness_n_m, fit.damping_n_m_s) for fit in fits])  # (f, 2)
    errors = np.array([(fit.stiffness_se_n_m, fit.damping_se_n_m_s) for fit in fits]) / values
    weight = errors**-2.0
    mean = (weight * np.log(values)).sum(axis=0) / weight.sum(axis=0)  # (2,)
    scatter = (weight * (np.log(values) - mean) ** 2).sum(axis=0)
    birge = np.sqrt(np.maximum(scatter / max(len(fits) - 1, 1), 1.0))
    (stiffness, damping), relative = np.exp(mean), birge / np.sqrt(weight.sum(axis=0))
    flags = []
    for k, (name, unit) in enumerate((("stiffness", "N m/rad"), ("damping", "N m s/rad"))):
        if len(fits) > 1 and chi2.sf(scatter[k], len(fits) - 1) < LEAST_CHANCE:
            parts = zip(fits, values[:, k], errors[:, k], strict=True)
            listed = ", ".join(f"{fit.name} {value:.3g} ± {value * error:.1g}" for fit, value, error in parts)
            message = f"the decays disagree about the {name} by more than their errors, look at each of them: {listed}"
            flags.append(Flag("decays_disagree", message=f"{message} {unit}"))
    return HingeEstimate(
        stiffness_n_m=float(stiffness),
        stiffness_se_n_m=float(stiffness * relative[0]),
        damping_n_m_s=float(damping),
        damping_se_n_m_s=float(damping * relative[1]),
        decays=len(fits),
        flags=tuple(flags),
    )


def fault_of_decay(fit: DecayFit) -> str | None:
    """Return why a free decay is not believed; None where it is."""
    if message := next((flag.message for flag in fit.flags if flag.kind in WRONG), None):
        return message
    se = fit.stiffness_se_n_m / fit.stiffness_n_m
    return None if se < WORST_SE[0] else f"it determines the stiffness to {100 * se:.0f} % only"


def decay_flags(trial: DecayTrial, fit: DecayFit, rejected: np.ndarray) -> Iterator[Flag]:
    """List the doubts about the fit of a decay.

    Args:
        trial: the decay.
        fit: its fit.
        rejected: (n, k) samples that were rejected as too far from the twin.
    """
    for name, out in zip(trial.markers, rejected.T, strict=True):
        if out.any():
            at = trial.first_frame + np.flatnonzero(out)
            message = f"{int(out.sum())} samples of {name} are farther off than any tracking error; they are left out"
            yield Flag("jump", (name,), (int(at[0]), int(at[-1])), message)
    for name, weight in zip(trial.markers, trial.weight.T, strict=True):
        if (seen := float((weight > 0).mean())) < LEAST_SEEN:
            message = f"{name} is missing or not believed in {100 * (1 - seen):.0f} % of the decay's frames"
            yield Flag("clipped", (name,), message=message)
    if (farthest := float(np.abs(fit.start_rad[0]).max())) > FARTHEST_RAD:
        message = f"a hinge is bent by {np.degrees(farthest):.0f} degrees, near its stop: bend the tail less"
        yield Flag("clipped", message=message)
    if fit.explained < LEAST_EXPLAINED and fit.rms_m > MISFIT_M:
        message = f"the twin explains only {100 * fit.explained:.1f} % of the decay: its hinges, masses or clamp differ"
        yield Flag("poor_fit", message=message)
    if not fit.converged:
        yield Flag("not_converged", message="the fit of the whole decay did not settle")
    relative = (fit.stiffness_se_n_m / fit.stiffness_n_m, fit.damping_se_n_m_s / fit.damping_n_m_s)
    for name, se, worst in zip(("stiffness", "damping"), relative, WORST_SE, strict=True):
        if not se < worst:
            yield Flag("unidentifiable", message=f"the decay determines the {name} to {100 * se:.0f} % only")
