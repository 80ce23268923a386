"""Dry runs: the measured motion of a tail whose crank turns in air, and the twin's response to such a turn.

`measure_dry_run` checks and scales the tracks of a run and finds its beat.

`simulate_response` simulates the tail on a few crank arms and speeds, and `DryResponse` interpolates in between. In air
and with the head clamped the tail follows the crank: one turn after the start its motion repeats to within 1e-4 mm. One
turn per arm and speed therefore holds every phase and every duration. It is not quite quasi-static: at 1.2 turns a
second a marker is up to 0.9 mm away from where it is at 0.2, but it changes smoothly, so that a few speeds and a
polynomial through them give the rest. Along the arm it is smooth between snaps: where the tendons buckle the tail
(beyond 41.5 mm on the published robot) the motion jumps, and nothing is interpolated across a jump.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np
import xarray as xr
from scipy.interpolate import BSpline, CubicSpline, barycentric_interpolate, make_interp_spline

from fitting.features import as_complex
from fitting.frequency import SwimFrequency, estimate_frequency
from fitting.motor_clock import MotorRecord
from fitting.pool import head_frame, head_is_trusted, in_pool
from fitting.trial import SCORED_S
from swimcal.errors import NotEnoughData, SimulationDiverged
from swimcal.flags import Flag
from swimcal.mjcf import DRY
from swimcal.robot import RobotSpec
from swimcal.runs import Runs
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of
from swimcal.twin import Twin

# The measured run
WARMUP_S = 1.0  # time in which the motor comes up to speed
HEAD_MOVES_M = 0.005  # motion of nose and neck together; a clamped head and a tracker's noise stay below
_FEWEST_FRAMES = 12  # least number of frames of a run

# The twin's response
ANGLES = 180  # angles of a turn in the table
TIMESTEP_S = 0.0015  # a third of the twin's own: the markers are then within 0.05 mm of those at 0.5 ms, at 1.2 Hz
FEWEST_ARMS = 4  # least number of arms of a branch that is interpolated
_SETTLING_TURNS = 1  # turns in which the motion settles
_SPEEDS = 6  # speeds of a range that are simulated
_JUMP = 3.0  # a jump exceeds the median change between neighbouring arms by this factor
PUBLISHED_STRETCH = 0.03  # "Simple Models, Real Swimming" (2026): about 3 % in use
SLACK = 1e-3  # a tendon shorter than at rest by more than this share is slack
_TENDON_ANGLES = 60  # angles of a turn at which the tendons are looked at


# The measured run.


@dataclass(frozen=True, eq=False)
class DryTrial:
    """One dry run: head clamped in air, the crank turning steadily.

    It holds only the n frames after the warm-up; with a usable motor log, those of its steady drive.

    Attributes:
        name: name of the trial.
        commanded_hz: commanded turns a second; None if not known.
        markers: names of the m markers.
        time_s: (n,) from the first frame of the recording, or of the drive where a motor log gives it, s.
        even_s: (n,) when the crank would be where it is if it turned evenly at its mean speed; `time_s` without a log.
        place_m: (n, m) x + i y on the pool, right-handed seen from above, m; nan where missing.
        head_m: (n, m) x + i y in the head frame (published normaliser), the nose starting at 0, m.
        weight: (n, m) 0 where a sample is flagged or missing.
        scored: (n,) the first 4 s, over which the published distance is taken.
        frequency: frequency of the tail's beat, without a model.
        tail: indices of the markers behind the head.
        flags: flags of tracks, beat and motor.
        motor: record of the motor; None without a log.
    """

    name: str
    commanded_hz: float | None
    markers: tuple[str, ...]
    time_s: np.ndarray
    even_s: np.ndarray
    place_m: np.ndarray
    head_m: np.ndarray
    weight: np.ndarray
    scored: np.ndarray
    frequency: SwimFrequency
    tail: tuple[int, ...]
    flags: tuple[Flag, ...]
    motor: MotorRecord | None = None

    @property
    def head_weight(self) -> np.ndarray:
        """Weight of each sample (n, m), 0 also where nose or neck is not trusted, so that the head frame is not."""
        trusted = head_is_trusted(self.markers, self.weight) & np.isfinite(self.head_m).any(axis=1)
        return np.where(np.isfinite(self.head_m), self.weight * trusted[:, None], 0.0)


def measure_dry_run(
    spec: TrialSpec,
    tracks: xr.Dataset,
    camera: CameraSpec,
    robot: RobotSpec,
    warmup_s: float = WARMUP_S,
    motor: MotorRecord | None = None,
) -> DryTrial:
    """Check and scale the tracks of a dry run and find its beat.

    Args:
        spec: the run.
        tracks: n frames of it.
        camera: the camera that filmed it.
        robot: the robot.
        warmup_s: time left out of every comparison, unless a usable log shows when the drive is steady.
        motor: record of the motor (`fitting.motor_clock.read_motor`); only the frames of its steady drive are then
            used, and how unevenly it turned. By default the crank turns evenly.

    Raises:
        NotEnoughData: no tail marker, too few frames after the warm-up, less than one beat, or a drive that was not
            filmed.
    """
    first_frame = 0
    if motor is not None and motor.usable:
        first_frame, tracks = motor.driven(tracks, spec.name)
        warmup_s = 0.0
    position_m, _, quality, tail = in_pool(tracks, camera, robot, f"trial {spec.name}")
    since_s = tracks.time.values - tracks.time.values[0]
    kept = since_s >= warmup_s - 1e-9
    if kept.sum() < _FEWEST_FRAMES:
        raise NotEnoughData(
            f"trial {spec.name}: {since_s[-1]:.2f} s leave {int(kept.sum())} frames after {warmup_s:g} s of "
            f"warm-up; at least {_FEWEST_FRAMES} are needed: shorten [fit] warmup_s or record longer"
        )
    time_s, weight = since_s[kept], quality.weight[kept]
    head = head_frame(markers_of(tracks), position_m[kept])
    lateral = head.shape_m[:, tail, 1]
    frequency = estimate_frequency(time_s, lateral, weight[:, tail], spec.commanded_hz)
    motor = None if motor is None else motor.against(frequency, tracks.time.values[kept])
    even_s = time_s
    if motor is not None and motor.usable:
        crank_rad = motor.turn.angle(tracks.time.values)
        slope, start = np.polyfit(since_s, crank_rad, 1)
        even_s = ((crank_rad - start) / slope)[kept]
    of_frames = (*quality.flags, *frequency.flags, *_moving_head(position_m[kept], markers_of(tracks)))
    trial = DryTrial(
        name=spec.name,
        commanded_hz=spec.commanded_hz,
        markers=markers_of(tracks),
        time_s=time_s,
        even_s=even_s,
        place_m=as_complex(position_m[kept]),
        head_m=as_complex(head.position_m),
        weight=np.where(np.isfinite(position_m[kept]).all(axis=-1), weight, 0.0),
        scored=time_s < time_s[0] + SCORED_S - 1e-9,
        frequency=frequency,
        tail=tuple(tail),
        flags=(*(flag.later(first_frame) for flag in of_frames), *(motor.flags if motor else ())),
        motor=motor,
    )
    if not trial.head_weight[trial.scored].any():
        raise NotEnoughData(f"trial {spec.name}: nose and neck are never both trusted in the first {SCORED_S:g} s")
    return trial


def _moving_head(position_m: np.ndarray, markers: tuple[str, ...]) -> tuple[Flag, ...]:
    head = position_m[:, [markers.index("nose"), markers.index("neck")]].mean(axis=1)
    head = head[np.isfinite(head).all(axis=1)]
    moved = float(np.percentile(np.linalg.norm(head - np.median(head, axis=0), axis=1), 90)) if len(head) else 0.0
    if moved <= HEAD_MOVES_M:
        return ()
    message = f"the head moves by {1000 * moved:.0f} mm; a dry run needs it clamped: is this a swim?"
    return (Flag("head_moves", message=message),)


# The twin's response to a turn of the crank.


class EvenTurn(NamedTuple):
    """One turn of the crank, evenly in time from angle 0.

    Attributes:
        marker_m: (angles, m) markers x + i y, robot frame, m.
        lead_rad: (angles,) crank ahead of an even turn.
    """

    marker_m: np.ndarray
    lead_rad: np.ndarray

    def at(self, angle_rad: np.ndarray) -> np.ndarray:
        """Return the markers (k, m) at k angles of the even turn, m."""
        return _periodic(self.marker_m)(angle_rad % (2 * np.pi))

    def crank_rad(self, angle_rad: float) -> float:
        """Return the angle of the crank itself at an angle of the even turn, from 0 to 2 pi."""
        return float((angle_rad + _periodic(self.lead_rad)(angle_rad % (2 * np.pi))) % (2 * np.pi))


@dataclass(frozen=True, eq=False)
class DryResponse:
    """One turn of the tail for each of a arms and s speeds.

    Attributes:
        markers: names of the m markers.
        arm_m: (a,) increasing, m.
        hz: (s,) turns a second, the nodes of a polynomial.
        marker_m: (a, s, angles, m) x + i y in the robot frame, m.
        lead_rad: (a, s, angles) crank ahead of an even turn.
    """

    markers: tuple[str, ...]
    arm_m: np.ndarray
    hz: np.ndarray
    marker_m: np.ndarray
    lead_rad: np.ndarray

    @cached_property
    def branches(self) -> tuple[slice, ...]:
        """Ranges of arms over which the motion is smooth, in order; the first holds the smallest arms."""
        change = np.abs(np.diff(self.marker_m, axis=0)).max(axis=(1, 2, 3))  # (a - 1,)
        limit = _JUMP * float(np.median(change))
        over_speed = np.abs(np.diff(self.marker_m, axis=1)).max(axis=(1, 2, 3))  # (a,)
        whole = over_speed <= limit
        cuts = [i + 1 for i in range(len(change)) if change[i] > limit or whole[i] != whole[i + 1]]
        edges = [0, *cuts, len(self.arm_m)]
        parts = [slice(low, high) for low, high in pairwise(edges)]
        return tuple(p for p in parts if p.stop - p.start >= FEWEST_ARMS and whole[p].all())

    def branch_at(self, arm_m: float) -> int:
        """Return the branch that holds this arm, or the nearest one."""
        gaps = [max(low - arm_m, arm_m - high, 0.0) for low, high in map(self.range_of, range(len(self.branches)))]
        return int(np.argmin(gaps))

    def range_of(self, branch: int) -> tuple[float, float]:
        """Return the smallest and largest arm of a branch, m."""
        part = self.arm_m[self.branches[branch]]
        return float(part[0]), float(part[-1])

    def turn(self, arm_m: float, hz: float, branch: int) -> EvenTurn:
        """Return the turn at an arm within a branch and a speed within the nodes.

        Args:
            arm_m: crank arm, m.
            hz: turns a second.
            branch: number of the branch.
        """
        markers, lead = self._splines[branch]
        weights = self.speed_weights(hz)
        return EvenTurn(np.tensordot(weights, markers(arm_m), 1), np.tensordot(weights, lead(arm_m), 1))

    def speed_weights(self, hz: float) -> np.ndarray:
        """Return the weight of each node in the Lagrange polynomial at a speed, (s,)."""
        return barycentric_interpolate(self.hz, np.eye(len(self.hz)), hz, rng=0)  # unseeded, it shuffles the nodes

    def select(self, markers: Sequence[str]) -> "DryResponse":
        """Return the response of these markers alone, in the order given."""
        index = [self.markers.index(name) for name in markers]
        return replace(self, markers=tuple(markers), marker_m=self.marker_m[..., index])

    @cached_property
    def _splines(self) -> tuple[tuple[BSpline, BSpline], ...]:
        return tuple(
            (make_interp_spline(self.arm_m[b], self.marker_m[b]), make_interp_spline(self.arm_m[b], self.lead_rad[b]))
            for b in self.branches
        )


def simulate_response(
    robot: RobotSpec,
    markers: tuple[str, ...],
    arm_m: np.ndarray,
    range_hz: tuple[float, float],
    workers: int = 0,
) -> DryResponse:
    """Turn the crank at every arm and at the Chebyshev nodes of a range of speeds.

    Arms with which the simulation does not stay bounded are left out.

    Args:
        robot: the robot; its own arm is not used.
        markers: names of the m markers.
        arm_m: (a,) increasing, m.
        range_hz: slowest and fastest commanded turns a second.
        workers: threads; 0 for all cores.

    Raises:
        NotEnoughData: fewer than four neighbouring arms have a bounded and smooth motion.
    """
    low, high = range_hz
    nodes = -np.cos(np.pi * (np.arange(_SPEEDS) + 0.5) / _SPEEDS)
    hz = (low + high) / 2 + (high - low) / 2 * nodes / nodes[-1]  # the outermost are the ends of the range
    arms, turns = [], []
    for arm in arm_m:
        try:
            turns.append(simulate_turns(with_arm(robot, float(arm)), markers, hz, workers))
        except SimulationDiverged:
            continue
        arms.append(float(arm))
    if len(arms) >= FEWEST_ARMS:
        marker_m, lead_rad = (np.stack(part) for part in zip(*turns, strict=True))
        response = DryResponse(markers, np.array(arms), hz, marker_m, lead_rad)
        if response.branches:
            return response
    raise NotEnoughData(
        f"the tail of {robot.name} has no smooth motion over four neighbouring crank arms from {arm_m[0]:.4g} to "
        f"{arm_m[-1]:.4g} m; expected one around crank.arm_m = {robot.crank.arm_m:g}. Check the robot's file"
    )


def with_arm(robot: RobotSpec, arm_m: float) -> RobotSpec:
    """Return the same robot with another crank arm."""
    return robot.changed(crank={"arm_m": arm_m})


def simulate_turns(robot: RobotSpec, markers: tuple[str, ...], hz: np.ndarray, workers: int = 0) -> EvenTurn:
    """Simulate one settled turn of the crank at each of s speeds: marker_m (s, angles, m), lead_rad (s, angles).

    Args:
        robot: the robot.
        markers: names of the m markers.
        hz: (s,) turns a second.
        workers: threads; 0 for all cores.

    Raises:
        SimulationDiverged: the motion does not stay bounded.
    """
    twin = Twin(robot, markers, replace(DRY, timestep_s=min(TIMESTEP_S, robot.time_step_s)), workers)
    fine = np.linspace(_SETTLING_TURNS - 0.05, _SETTLING_TURNS + 1.05, 2 * ANGLES + 1)
    time_s = fine[None, :] / hz[:, None]  # (s, 2 angles + 1)
    run = twin.simulate(Runs(np.zeros((len(hz), 5)), hz, np.zeros(len(hz))), time_s)
    marker_m = run.marker_m[..., 0] + 1j * run.marker_m[..., 1]  # (s, f, m)
    turns = [_one_turn(*part) for part in zip(time_s, run.crank_rad, marker_m, strict=True)]
    return EvenTurn(*(np.stack(part) for part in zip(*turns, strict=True)))


def _one_turn(time_s: np.ndarray, crank_rad: np.ndarray, marker_m: np.ndarray) -> EvenTurn:
    """Cut out one turn from where the crank passes 0, evenly in time; the motor runs a little below its command."""
    passes = CubicSpline(crank_rad, time_s)(2 * np.pi * np.array([_SETTLING_TURNS, _SETTLING_TURNS + 1]))
    share = np.arange(ANGLES) / ANGLES
    at = passes[0] + (passes[1] - passes[0]) * share
    lead = CubicSpline(time_s, crank_rad)(at) - 2 * np.pi * (_SETTLING_TURNS + share)
    return EvenTurn(CubicSpline(time_s, marker_m)(at), lead)


def _periodic(table: np.ndarray) -> CubicSpline:
    """Interpolate a table (angles, ...) of one turn periodically."""
    angle = np.linspace(0.0, 2 * np.pi, len(table) + 1)
    return CubicSpline(angle, np.concatenate([table, table[:1]]), bc_type="periodic")


# What the tendons do meanwhile.


class TendonUse(NamedTuple):
    """Use of both tendons over one settled turn.

    Attributes:
        stretch, shortening: largest relative stretch and shortening.
        slack_share: share of the time in which they are slack.
    """

    stretch: float
    shortening: float
    slack_share: float


def tendon_use(robot: RobotSpec, hz: np.ndarray, workers: int = 0) -> tuple[TendonUse, ...]:
    """Return the use of a robot's tendons in air at each of s speeds.

    Args:
        robot: the robot.
        hz: (s,) turns a second.
        workers: threads; 0 for all cores.

    Raises:
        SimulationDiverged: the motion does not stay bounded.
    """
    twin = Twin(robot, ("nose",), replace(DRY, timestep_s=min(TIMESTEP_S, robot.time_step_s)), workers)
    time_s = (1.0 + np.arange(_TENDON_ANGLES) / _TENDON_ANGLES) / hz[:, None]
    run = twin.simulate(Runs(np.zeros((len(hz), 5)), hz, np.zeros(len(hz))), time_s)
    # (s, angles, q): a clamped head has no joints
    states = np.concatenate([run.crank_rad[..., None], run.hinges_rad], axis=-1)
    longer = [_elongation(twin.model, turn) for turn in states]
    return tuple(TendonUse(float(e.max()), float(-e.min()), float((e < -SLACK).mean())) for e in longer)


def _elongation(model: mujoco.MjModel, states: np.ndarray) -> np.ndarray:
    """Return the tendons' length over that at rest, less 1, (k, tendons), in k states (k, q)."""
    data = mujoco.MjData(model)
    length = np.zeros((len(states), model.ntendon))
    for i, state in enumerate(states):
        data.qpos[:] = state
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        length[i] = data.ten_length
    return length / model.tendon_lengthspring[:, 0] - 1
