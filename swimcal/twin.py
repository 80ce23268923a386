"""The twin: many simulations of one robot at once, from crank speeds to marker trajectories.

Everything that differs between simulations (coefficients, frequency, phase, any field of the model) is written into
one `mujoco.batch.Batch`, so nothing is compiled inside a fit and all cores are used.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import mujoco
import numpy as np
from mujoco.batch import Batch
from scipy.interpolate import CubicSpline

from swimcal.errors import SimulationDiverged
from swimcal.mjcf import DRY, Scene, build_mjcf, swim_scene
from swimcal.robot import RobotSpec
from swimcal.robot_doubts import robot_doubts
from swimcal.runs import MarkerKinematics, Runs, Trajectories, quiet_engine, workers_of

FORCE_FIELDS = slice(1, 6)  # columns of geom_fluid: blunt, slender, angular drag, Kutta and Magnus lift
PLAUSIBLE_HINGE_RAD = np.pi / 2  # the published model stops its hinges at 80 degrees; beyond 90 nothing is physical
PLAUSIBLE_SPEED_M_S = 5.0
_PHASES = 48  # phases in the table of quasi-static tail poses
_SLOW_TURN_S = 4.0  # turn in which they are read off
FOLLOWING_N_M_S = 1e5  # speed gain of a crank that follows a measured turn, whatever pulls at it
CONTROL = int(mujoco.mjtState.mjSTATE_CTRL)
_CHUNK = 512  # simulations whose trajectories are held in memory at once
_TOGETHER = 64  # runs whose ends are within this many steps end together


class Twin:
    """The robot's simulator.

    Args:
        robot: the robot.
        markers: names of the m markers wanted; default all of the robot's.
        scene: in water or clamped in air; its time step. Default: swimming, with the time step of the robot.
        workers: threads; 0 for all cores.
    """

    def __init__(
        self,
        robot: RobotSpec,
        markers: tuple[str, ...] | None = None,
        scene: Scene | None = None,
        workers: int = 0,
    ) -> None:
        self.robot = robot
        self.markers = tuple(robot.markers) if markers is None else markers
        self.scene = scene or swim_scene(robot)
        self.model = build_mjcf(robot, scene=self.scene).compile()
        self.workers = workers_of(workers)
        self._kinematics = MarkerKinematics(robot, self.markers)
        self._batches: dict[tuple[int, frozenset[str]], Batch] = {}
        self._at_steps: dict[float, Twin] = {}
        joint = {self.model.joint(i).name: i for i in range(self.model.njnt)}
        self._hinges = [joint[name] for name in robot.hinges]
        self._crank = joint["crank"]
        self._fluid_geoms = np.flatnonzero(self.model.geom_fluid[:, 0] > 0)

    def at_step(self, timestep_s: float) -> "Twin":
        """Return the same twin with another time step, s; every time the same object, whose models are built once."""
        if timestep_s not in self._at_steps:
            scene = replace(self.scene, timestep_s=timestep_s)
            self._at_steps[timestep_s] = Twin(self.robot, self.markers, scene, self.workers)
        return self._at_steps[timestep_s]

    def of_robot(self, robot: RobotSpec) -> "Twin":
        """Return the same twin of another robot."""
        return Twin(robot, self.markers, self.scene, self.workers)

    def simulate(self, runs: Runs, time_s: np.ndarray, *, allow_divergence: bool = False) -> Trajectories:
        """Simulate every run from time 0 and read the markers off at the given times.

        The crank starts at its phase, turning; the tail starts in the pose that the tendons give it there, moving with
        the crank; the head with the velocity asked for (at rest by default).

        Args:
            runs: n simulations.
            time_s: (f,) common to all or (n, f), not before 0, s.
            allow_divergence: return nan and mark what diverges instead of raising.

        Raises:
            SimulationDiverged: a simulation blew up and `allow_divergence` is False; or the tail cannot even be
                brought into the poses it starts in.
            ValueError: a time before 0.
        """
        if np.min(time_s) < 0:
            raise ValueError(f"time_s: found {np.min(time_s):g} s, expected times from 0, where the runs start")
        count = len(runs)
        chunks = [np.arange(i, min(i + _CHUNK, count)) for i in range(0, count, _CHUNK)]
        parts = [self._simulate_chunk(runs.part(rows), time_s[rows] if time_s.ndim == 2 else time_s) for rows in chunks]
        head, hinges, crank, diverged = (np.concatenate(part) for part in zip(*parts, strict=True))
        if diverged.any() and not allow_divergence:
            raise SimulationDiverged(_divergence_message(runs, diverged))
        marker = self._kinematics(head, hinges)
        return Trajectories(time_s, marker, head, hinges, crank, diverged)

    def _simulate_chunk(self, runs: Runs, time_s: np.ndarray) -> tuple[np.ndarray, ...]:
        """Simulate a chunk of runs, equal ones once and for as long as any of them."""
        first, like = self._distinct(runs)
        last_s = np.zeros(len(first))
        np.maximum.at(last_s, like, np.broadcast_to(np.max(time_s, axis=-1), len(runs)))
        states, diverged = self._states(runs.part(first), self._steps(last_s))
        diverged = diverged[like]
        at = _interpolate(states, like, time_s / self.scene.timestep_s)  # (n, f, q)
        head = np.zeros((*at.shape[:2], 3)) if self.scene.head_clamped else at[..., :3]
        return head, at[..., self._hinges], at[..., self._crank], diverged

    def _distinct(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (r,) of runs whose fish all move differently, and which of these each run equals (n,)."""
        return runs.distinct()

    def _states(self, runs: Runs, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, 1 + s, q) of each run after every step from time 0 on, and which runs diverged (n,).

        A run takes as many steps as `steps` (n,) says. Positions of a diverged run are nan.
        """
        batch = self._batch(runs)
        start, velocity = self.start(runs)
        batch.bind("qpos")[:], batch.bind("qvel")[:] = start, velocity
        batch.bind("ctrl")[:, 0] = 2 * np.pi * runs.frequency_hz
        with quiet_engine():
            rolled = self._roll(batch, runs, steps)
        states = np.concatenate([start[:, None], rolled], axis=1)
        diverged = self._find_diverged(states, runs, steps)
        states[diverged] = np.nan
        return states, diverged

    def _steps(self, last_s: np.ndarray) -> np.ndarray:
        """Return the number of steps (n,) of runs until times (n,), s.

        They have two more to interpolate with, and are rounded up to a multiple.
        """
        return _TOGETHER * np.ceil((np.ceil(last_s / self.scene.timestep_s) + 2) / _TOGETHER).astype(int)

    def _roll(self, batch: Batch, runs: Runs, steps: np.ndarray) -> np.ndarray:
        """Roll the runs out, and return the positions after each step (n, s, q).

        A run with fewer steps (n,) than the longest rests where it ends. So does one that the engine gave up, which
        else would go on once another ends.
        """
        speeds = runs.crank_speeds(int(steps.max()), self.scene.timestep_s)
        rolled, begin = np.empty((len(runs), steps.max(), self.model.nq)), 0
        given_up = np.zeros(len(runs), bool)
        for end in np.unique(steps):
            ids = np.flatnonzero((steps >= end) & ~given_up)
            control = None if speeds is None else speeds[ids, begin:end]
            rolled[ids, begin:end] = batch.rollout(end - begin, control, CONTROL, record=("qpos",), ids=ids)["qpos"]
            given_up[ids] = (rolled[ids, end - 1] == rolled[ids, end - 2]).all(axis=1)
            rests = (steps == end) | given_up
            rolled[rests, end:] = rolled[rests, end - 1, None]
            begin = end
        return rolled

    def _batch(self, runs: Runs) -> Batch:
        """Return a batch of the right size that expands just the fields these runs set."""
        follows = frozenset() if runs.turns is None else frozenset({"turns"})
        key = (len(runs), frozenset(runs.fields) | follows)
        if key not in self._batches:
            if len(self._batches) > 8:
                self._batches.clear()
            self._batches[key] = Batch(self.model, len(runs), self.workers)
        batch = self._batches[key]
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        fluid = batch.expand("geom_fluid")
        fluid[:, self._fluid_geoms, FORCE_FIELDS] = runs.coefficients[:, None, :]
        for name, values in runs.fields.items():
            batch.expand(name)[:] = values
        if runs.turns is not None:
            logged = [turn is not None and turn.logged for turn in runs.turns]
            gain = np.where(logged, FOLLOWING_N_M_S, self.robot.crank.speed_gain_n_m_s)
            batch.expand("actuator_gainprm")[:, 0, 0] = gain
            batch.expand("actuator_biasprm")[:, 0, 2] = -gain
        return batch

    def start(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, q) and velocities (n, v) of the joints at time 0."""
        count, speed = len(runs), runs.start_speed_rad_s
        position, velocity = np.zeros((count, self.model.nq)), np.zeros((count, self.model.nv))
        position[:, self._hinges] = self._pose(runs.phase_rad)
        velocity[:, self._hinges] = self._pose(runs.phase_rad, 1) * speed[:, None]
        position[:, self._crank], velocity[:, self._crank] = runs.phase_rad, speed
        if runs.velocity is not None and not self.scene.head_clamped:
            velocity[:, :3] = runs.velocity
        return position, velocity

    @cached_property
    def _pose(self) -> CubicSpline:
        """Hinge angles (h,) that the tendons hold, as a smooth periodic function of the crank's phase (rad).

        They are read off the second of two slow turns of the crank with the head clamped in air; the first only
        settles.
        """
        table = np.zeros((_PHASES + 1, len(self._hinges)))
        if self.scene.with_tendons:
            model = build_mjcf(self.robot, scene=replace(DRY, timestep_s=self.scene.timestep_s)).compile()
            data = mujoco.MjData(model)
            steps = round(_SLOW_TURN_S / _PHASES / model.opt.timestep)
            data.qvel[0] = data.ctrl[0] = 2 * np.pi / (_PHASES * steps * model.opt.timestep)
            with quiet_engine():
                for i in range(2 * _PHASES):
                    table[i % _PHASES] = data.qpos[1:]
                    mujoco.mj_step(model, data, steps)
            if not (np.abs(table) < PLAUSIBLE_HINGE_RAD).all():  # nan too
                doubts = "".join(f" {doubt}" for doubt in robot_doubts(self.robot))
                raise SimulationDiverged(
                    f"The tail of {self.robot.name} cannot be brought into its starting poses: with steps of "
                    f"{self.scene.timestep_s:g} s its tendons are unstable. Expected a bounded motion; try a smaller "
                    f"time_step_s in the robot's file, softer tendons or a shorter crank arm.{doubts}"
                )
            table[-1] = table[0]
        return CubicSpline(np.linspace(0.0, 2 * np.pi, _PHASES + 1), table, bc_type="periodic")

    def _find_diverged(self, states: np.ndarray, runs: Runs, steps: np.ndarray) -> np.ndarray:
        """Tell for each run (n,) whether a state is not finite, stands still in its last steps or is out of scale."""
        with np.errstate(invalid="ignore"):
            finite = np.isfinite(states).all(axis=(1, 2))
            bent = np.abs(states[..., self._hinges]).max(axis=(1, 2)) > PLAUSIBLE_HINGE_RAD
            last = np.take_along_axis(states[..., self._crank], steps[:, None] + np.array([-2, -1, 0]), axis=1)
            stopped = (np.diff(last, axis=1) == 0).all(axis=1)
            stopped &= runs.turns is None or np.array([turn is None for turn in runs.turns])  # a measured one may rest
            fast = np.zeros(len(states), bool)
            if not self.scene.head_clamped:
                step = np.abs(np.diff(states[..., :2], axis=1)).max(axis=(1, 2))
                fast = step > PLAUSIBLE_SPEED_M_S * self.scene.timestep_s
        moving = states[:, -1, self._crank] != states[:, 0, self._crank]
        return ~finite | bent | fast | (stopped & moving)


def simulate_together(twins: Sequence[Twin], runs: Sequence[Runs], time_s: Sequence[np.ndarray]) -> list[Trajectories]:
    """Simulate several lots of runs; what diverges is nan.

    Those with the same twin are simulated at once, so that the cores share them.

    Args:
        twins: the twin of each lot.
        runs: the runs of each lot.
        time_s: (f,) times of each lot, s.
    """
    found: dict[int, Trajectories] = {}
    for twin in {id(twin): twin for twin in twins}.values():
        lots = [number for number, own in enumerate(twins) if own is twin]
        longest = max(len(time_s[lot]) for lot in lots)
        padded = [np.pad(time_s[lot], (0, longest - len(time_s[lot])), mode="edge") for lot in lots]
        stamped = np.repeat(padded, [len(runs[lot]) for lot in lots], axis=0)
        simulated = twin.simulate(runs[lots[0]].joined([runs[lot] for lot in lots]), stamped, allow_divergence=True)
        end = 0
        for lot in lots:
            begin, end = end, end + len(runs[lot])
            found[lot] = simulated.part(np.arange(begin, end), len(time_s[lot]))
    return [found[lot] for lot in range(len(twins))]


def _interpolate(states: np.ndarray, rows: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Interpolate samples one step apart at fractional steps, by cubic Lagrange polynomials.

    Args:
        states: (r, s, q) samples.
        rows: (n,) which of the r are read.
        where: (f,) or (n, f) fractional steps.

    Returns:
        (n, f, q).
    """
    low = np.clip(np.floor(where).astype(int), 1, states.shape[1] - 3)
    t = where - low
    weights = np.stack(
        [
            -t * (t - 1) * (t - 2) / 6,
            (t + 1) * (t - 1) * (t - 2) / 2,
            -(t + 1) * t * (t - 2) / 2,
            (t + 1) * t * (t - 1) / 6,
        ]
    )
    total = np.zeros((len(rows), where.shape[-1], states.shape[2]))
    for offset, weight in zip((-1, 0, 1, 2), weights, strict=True):
        total += weight[..., None] * states[rows[:, None], low + offset]
    return total


def _divergence_message(runs: Runs, diverged: np.ndarray) -> str:
    first = int(np.flatnonzero(diverged)[0])
    coefficients = ", ".join(f"{c:.3g}" for c in runs.coefficients[first])
    return (
        f"{int(diverged.sum())} of {len(runs)} simulations diverged; the first at coefficients [{coefficients}], "
        f"{runs.frequency_hz[first]:.3g} Hz. Expected a bounded motion; try a smaller time_step_s in the "
        "robot's file, or keep the coefficients within [0, 10]."
    )
