"""Batched runs of the engine: their inputs, the trajectories they return, and the engine's threads, log and version.

`Runs` are the inputs that differ between simulations, the measured `CrankTurn` of a crank among them; `Trajectories`
are their results. `MarkerKinematics` are the planar forward kinematics of the chain, from joint positions to marker
positions: faster than asking the engine for its sites at every frame, and exact at interpolated times.

`quiet_engine` keeps the engine's own log quiet: where we look for divergence we report it in our own words.
`check_engine` refuses a calibration of another engine or model: coefficients fitted with one engine are void with
another.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from typing import Any, Protocol, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_smoothing_spline

from swimcal.errors import ModelMismatch
from swimcal.mjcf import FluidCoefficients, build_mjcf
from swimcal.results import Provenance
from swimcal.robot import RobotSpec

RESOLUTION_S = 0.02
"""Changes of speed faster than about this are taken for the encoder's steps and the host's uneven reading."""
_FEWEST = 5  # readings that a smoothing spline needs

VARIABLE = "SWIMCAL_WORKERS"

ENGINE = mujoco.__version__


class Turn(Protocol):
    """A turn of the crank from time 0 on; `logged` if a log shows it, so that no load changes it."""

    @property
    def logged(self) -> bool: ...  # noqa: D102

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        ...

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        ...


@dataclass(frozen=True, eq=False)
class CrankTurn:
    """A measured turn of the crank, for instance from the motor's log.

    Attributes:
        spline: angle (rad) over time (s); unwrapped, in the direction in which it grows as a whole.
        start_s, end_s: the measured stretch; beyond it the crank turns on with the speed it had there.
    """

    spline: BSpline
    start_s: float
    end_s: float
    logged: bool = True

    @classmethod
    def measured(cls, time_s: np.ndarray, angle_rad: np.ndarray) -> "CrankTurn":
        """Fit a smoothing cubic spline to k readings (Woltring 1986).

        Which way round the shaft turned is left out: the tail of a robot with equal tendons moves the same either way,
        half a turn apart.

        Args:
            time_s: (k,) s.
            angle_rad: (k,) unwrapped angle, rad.

        Raises:
            ValueError: fewer than five readings, or times that do not grow.
        """
        if len(time_s) < _FEWEST or not (np.diff(time_s) > 0).all():
            raise ValueError(f"time_s: found {len(time_s)} readings, expected at least {_FEWEST} at growing times")
        forward = 1.0 if angle_rad[-1] >= angle_rad[0] else -1.0
        spacing = float(np.median(np.diff(time_s)))
        spline = make_smoothing_spline(time_s, forward * angle_rad, lam=RESOLUTION_S**4 / (16 * spacing))
        return cls(spline, float(time_s[0]), float(time_s[-1]))

    def shifted(self, offset_s: float, rate: float = 1.0) -> "CrankTurn":
        """Return the same turn on another clock, on which its instant ``t`` is ``(t - offset_s) / rate``."""
        knots = (self.spline.t - offset_s) / rate
        return CrankTurn(
            BSpline(knots, self.spline.c, self.spline.k),
            (self.start_s - offset_s) / rate,
            (self.end_s - offset_s) / rate,
        )

    def angle(self, time_s: ArrayLike) -> np.ndarray:
        """Return the angle (f,) since time 0, rad."""
        return self._along(np.asarray(time_s, float)) - self._along(np.zeros(1))[0]

    def speed(self, time_s: ArrayLike) -> np.ndarray:
        """Return the speed (f,), rad/s."""
        return self.spline.derivative()(np.clip(time_s, self.start_s, self.end_s))

    def mean_hz(self, start_s: float, end_s: float) -> float:
        """Return the mean frequency of the crank between two instants (s), Hz."""
        angle = self.angle(np.array([start_s, end_s]))
        return float((angle[1] - angle[0]) / (2 * np.pi * (end_s - start_s)))

    def _along(self, time_s: np.ndarray) -> np.ndarray:
        inside = np.clip(time_s, self.start_s, self.end_s)
        return self.spline(inside) + self.speed(time_s) * (time_s - inside)


@dataclass(frozen=True, eq=False)
class Runs:
    """Inputs that differ between n simulations.

    Attributes:
        coefficients: (n, 5) blunt, slender and angular drag, Kutta and Magnus lift.
        frequency_hz: (n,) turns of the crank a second.
        phase_rad: (n,) crank angle at time 0; the tail is straight at 0 and pulled to the left at pi / 2.
        turns: n measured turns that the cranks make from there on; None where one turns evenly at its frequency.
            None for all: every crank turns evenly.
        velocity: (n, 3) of the head at time 0 in its own axes: along +x (backward), along +y (right), m/s; yaw, rad/s.
        fields: further fields of the model by name, each (n, ...), for instance `jnt_stiffness`.
    """

    coefficients: np.ndarray
    frequency_hz: np.ndarray
    phase_rad: np.ndarray
    velocity: np.ndarray | None = None
    fields: Mapping[str, np.ndarray] = field(default_factory=dict)
    turns: tuple[Turn | None, ...] | None = None

    def __len__(self) -> int:
        return len(self.frequency_hz)

    def __post_init__(self) -> None:
        n = len(self.frequency_hz)
        shapes = {"coefficients": (n, 5), "phase_rad": (n,)} | ({} if self.velocity is None else {"velocity": (n, 3)})
        for name, expected in shapes.items():
            if (found := np.shape(getattr(self, name))) != expected:
                raise ValueError(f"{name}: found shape {found}, expected {expected} for {n} simulations")
        for name, values in self.fields.items():
            if (found := np.shape(values))[:1] != (n,):
                raise ValueError(f"fields[{name!r}]: found shape {found}, expected ({n}, ...) for {n} simulations")
        if self.turns is not None and len(self.turns) != n:
            raise ValueError(f"turns: found {len(self.turns)}, expected {n}, one for each simulation")

    def part(self, rows: np.ndarray) -> Self:
        """Return some of the runs, by their numbers (r,)."""
        return replace(self, **{each.name: _rows(getattr(self, each.name), rows) for each in fields(self)})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Join the runs of several parts, one after the other; all set the same fields, and all or none a velocity."""
        first, turned = parts[0], any(part.turns is not None for part in parts)
        turns = [turn for part in parts for turn in (part.turns or (None,) * len(part))]
        velocities = [part.velocity for part in parts if part.velocity is not None]
        return replace(
            first,
            coefficients=np.concatenate([part.coefficients for part in parts]),
            frequency_hz=np.concatenate([part.frequency_hz for part in parts]),
            phase_rad=np.concatenate([part.phase_rad for part in parts]),
            velocity=np.concatenate(velocities) if velocities else None,
            fields={name: np.concatenate([part.fields[name] for part in parts]) for name in first.fields},
            turns=tuple(turns) if turned else None,
        )

    def distinct(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (r,) of runs that all differ, and which of these each run equals (n,)."""
        turns = (None,) * len(self) if self.turns is None else self.turns
        numbers = np.hstack([np.reshape(own, (len(self), -1)) for own in self._numbers()])
        keys = [(row.tobytes(), id(turn)) for row, turn in zip(numbers, turns, strict=True)]
        place = {key: number for number, key in enumerate(dict.fromkeys(keys))}
        like = np.array([place[key] for key in keys])
        return np.unique(like, return_index=True)[1], like

    def _numbers(self) -> list[np.ndarray]:
        """Return all numbers in which one run can differ from another, each (n, …), but turns."""
        velocity = [] if self.velocity is None else [self.velocity]
        return [self.coefficients, self.frequency_hz, self.phase_rad, *velocity, *self.fields.values()]

    @property
    def start_speed_rad_s(self) -> np.ndarray:
        """Speed of each crank at time 0, (n,), rad/s."""
        even = 2 * np.pi * np.asarray(self.frequency_hz, float)
        if self.turns is None:
            return even
        return np.array(
            [speed if turn is None else turn.speed(0.0) for turn, speed in zip(self.turns, even, strict=True)]
        )

    def crank_speeds(self, steps: int, timestep_s: float) -> np.ndarray | None:
        """Return the mean speed of each crank over each step (n, steps, 1), rad/s; None where all turn evenly."""
        if self.turns is None or not any(self.turns):
            return None
        speeds = np.repeat(2 * np.pi * np.asarray(self.frequency_hz, float)[:, None], steps, axis=1)
        known: dict[int, np.ndarray] = {}
        for row, turn in enumerate(self.turns):
            if turn is not None:
                if id(turn) not in known:
                    known[id(turn)] = np.diff(turn.angle(np.arange(steps + 1) * timestep_s)) / timestep_s
                speeds[row] = known[id(turn)]
        return speeds[..., None]


def _rows(values: Any, rows: np.ndarray) -> Any:
    """Return some rows of an array, of all arrays of a mapping, or of a tuple; None stays None."""
    if isinstance(values, Mapping):
        return {name: each[rows] for name, each in values.items()}
    return tuple(values[row] for row in rows) if isinstance(values, tuple) else None if values is None else values[rows]


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Results of n simulations at f times.

    Attributes:
        time_s: (f,) or (n, f).
        marker_m: (n, f, m, 2) in the pool: the head's frame starts at the origin, heading along -x, m.
        head: (n, f, 3) x, y (m) and yaw (rad) of the head's frame.
        hinges_rad: (n, f, h).
        crank_rad: (n, f).
        diverged: (n,) True where the simulation blew up; its arrays then hold nan alone.
    """

    time_s: np.ndarray
    marker_m: np.ndarray
    head: np.ndarray
    hinges_rad: np.ndarray
    crank_rad: np.ndarray
    diverged: np.ndarray

    def part(self, rows: np.ndarray, frames: int) -> "Trajectories":
        """Return some of the simulations, by their numbers (r,), up to a frame."""
        return Trajectories(
            self.time_s[:frames] if self.time_s.ndim == 1 else self.time_s[rows, :frames],
            self.marker_m[rows, :frames],
            self.head[rows, :frames],
            self.hinges_rad[rows, :frames],
            self.crank_rad[rows, :frames],
            self.diverged[rows],
        )


class MarkerKinematics:
    """Positions of m chosen markers, in the order given, as a function of the planar pose of the chain."""

    def __init__(self, robot: RobotSpec, names: tuple[str, ...]) -> None:
        origins = np.concatenate([[0.0], robot.hinge_x_m])  # (l,) of each link on the straight robot
        self._steps = np.diff(origins)  # (h,) from each link's origin to the next
        self._link = np.array([robot.links.index(robot.markers[n].body) for n in names])  # (m,)
        local = robot.marker_positions_m(names)[:, :2]
        local[:, 0] -= origins[self._link]
        self._local = local  # (m, 2)

    def __call__(self, head: np.ndarray, hinges_rad: np.ndarray) -> np.ndarray:
        """Return the marker positions in the pool.

        Args:
            head: (..., 3) x, y (m) and yaw (rad) of the head's frame.
            hinges_rad: (..., h) hinge angles.

        Returns:
            (..., m, 2) m.
        """
        heading = np.concatenate([head[..., 2:], head[..., 2:] + np.cumsum(hinges_rad, axis=-1)], axis=-1)
        cos, sin = np.cos(heading), np.sin(heading)  # (..., l)
        steps = np.stack([self._steps * cos[..., :-1], self._steps * sin[..., :-1]], axis=-1)  # (..., h, 2)
        origin = np.concatenate([head[..., None, :2], head[..., None, :2] + np.cumsum(steps, axis=-2)], axis=-2)
        cos, sin = cos[..., self._link], sin[..., self._link]  # (..., m)
        x, y = self._local.T
        return origin[..., self._link, :] + np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)

    def axes(self, head: np.ndarray, hinges_rad: np.ndarray) -> np.ndarray:
        """Return the axes of the link that carries each marker.

        Args:
            head: (..., 3) x, y (m) and yaw (rad) of the head's frame.
            hinges_rad: (..., h) hinge angles.

        Returns:
            (..., m, 2, 2) unit vectors in the pool along x and y of the link.
        """
        heading = np.concatenate([head[..., 2:], head[..., 2:] + np.cumsum(hinges_rad, axis=-1)], axis=-1)
        cos, sin = np.cos(heading)[..., self._link], np.sin(heading)[..., self._link]
        return np.stack([np.stack([cos, sin], axis=-1), np.stack([-sin, cos], axis=-1)], axis=-2)


def workers_of(wanted: int) -> int:
    """Return the number of threads: `wanted`, or if that is 0 the value of ``SWIMCAL_WORKERS``; 0 means all cores.

    Several processes with a thread each do more than several processes with threads on all cores each.

    Raises:
        ValueError: the variable is no number.
    """
    setting = os.environ.get(VARIABLE, "0")
    if not setting.isdecimal():
        raise ValueError(f"{VARIABLE}: found {setting!r}, expected a number of threads, or 0 for all cores")
    return wanted or int(setting)


@contextmanager
def quiet_engine() -> Iterator[None]:
    """Keep the engine from printing warnings and from writing MUJOCO_LOG.TXT into the user's folder."""
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_console = quiet.logto_file = False
    quiet.set()
    try:
        yield
    finally:
        before.set()


def model_sha256(robot: RobotSpec) -> str:
    """Return a hash of everything in the robot's swimming model but the fluid coefficients."""
    spec = build_mjcf(robot, FluidCoefficients(0.0, 0.0, 0.0, 0.0, 0.0))
    spec.compile()
    return hashlib.sha256(spec.to_xml().encode()).hexdigest()


def check_engine(made_with: Provenance, robot: RobotSpec, file: str) -> None:
    """Refuse a calibration made with another engine or another model.

    The fluid model is not the same in every release: with 3.12 the published coefficients swim forward, from 3.14 on
    the same file swims backward.

    Args:
        made_with: engine and model of the calibration.
        robot: the robot.
        file: name of the calibration in messages.

    Raises:
        ModelMismatch: either differs.
    """
    pairs = {"MuJoCo": (made_with.mujoco, ENGINE), "model": (made_with.model_sha256, model_sha256(robot))}
    differ = [f"{what}: made with {then[:16]}, here {now[:16]}" for what, (then, now) in pairs.items() if then != now]
    if differ:
        raise ModelMismatch(
            f"{file}: this calibration was made with another engine or model ({'; '.join(differ)}). Its coefficients "
            "mean nothing here, because releases of the engine compute different fluid forces. Fit again with "
            "`calib fit`."
        )
