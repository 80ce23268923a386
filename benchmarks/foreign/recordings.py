"""Session as it is disturbed: what happened in the pool, what the tracks hold of it, and the folder that says so."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tomlkit
from scipy.interpolate import CubicSpline

from swimcal.motor_log import MotorCommands, MotorLog
from swimcal.robot import RobotSpec
from swimsynth.disturbances import TrackingNoise, lasting_errors, on_grid, placement_offsets
from swimsynth.simulate import save_commands, save_motor_log


@dataclass(frozen=True)
class Tracker:
    """Errors of tracks: those that last, those of single frames, boxes off their markers; all in px."""

    lasting: TrackingNoise
    white_px: float

    def errors(self, shape: tuple[int, ...], fps: float, random: np.random.Generator) -> np.ndarray:
        """Draw (n, m, 2) errors, px."""
        boxes = placement_offsets(shape[1], self.lasting, random)
        return boxes + lasting_errors(shape, 1 / fps, self.lasting, random) + self.white_px * random.normal(size=shape)


@dataclass
class Recording:
    """One trial.

    `pool_s` (k,) and `pool_px` (k, m, 2) are what truly happened, in small steps of time; from `film` on `time_s` (n,),
    `xy` (n, m, 2) and `sure` (n, m) are the tracks: nan is an empty cell.
    """

    name: str
    kind: str
    role: str
    hz: float  # frequency of the crank
    commanded_hz: float | None
    pool_s: np.ndarray
    pool_px: np.ndarray
    log: tuple[MotorLog, MotorCommands] | None = None
    steady_s: tuple[float, float] | None = None  # steady time of a drive from rest to rest
    like_twin: bool = True  # whether the robot described swam so, so that the true coefficients are right for it
    steady: bool = True  # whether it swims all the time, so that it has one speed
    said: str = ""  # words that the program has to say of it, or to leave it out
    growth: float = 0.0  # growth of its picture from the first frame to the last
    touched: bool = False  # whether any disturbance has befallen it
    time_s: np.ndarray = field(default_factory=lambda: np.zeros(0))
    xy: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 2)))
    sure: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def film(self, fps: float, tracker: Tracker, random: np.random.Generator, varied: float = 0.0) -> None:
        """Film and track the trial; by a camera whose frames are uneven by this share of their mean spacing."""
        frames = int((self.pool_s[-1] - self.pool_s[0]) * fps + 1e-6)
        steps = 1.0 + varied * random.uniform(-1.0, 1.0, frames)
        exposed = np.append(0.0, np.cumsum(steps / steps.sum())) * frames / fps
        true = CubicSpline(self.pool_s, self.pool_px)(self.pool_s[0] + exposed)
        centre = true.mean(axis=(0, 1))
        true = centre + (true - centre) * (1.0 + self.growth * (exposed / exposed[-1] - 0.5))[:, None, None]
        self.time_s, self.sure = exposed, np.ones(true.shape[:2])
        self.xy = on_grid(true + tracker.errors(true.shape, fps, random), tracker.lasting)

    def empty(self, markers: Iterable[int], frames: np.ndarray) -> None:
        """Empty the cells of these markers in these frames, (n,) bool."""
        self.xy[np.ix_(np.flatnonzero(frames), np.array(list(markers)))] = np.nan

    def keep(self, frames: np.ndarray) -> None:
        """Keep these frames alone in the tracks."""
        self.time_s, self.xy, self.sure = self.time_s[frames], self.xy[frames], self.sure[frames]


@dataclass
class Recordings:
    """One session."""

    robot: RobotSpec
    built_in: bool
    simulator: str  # "twin" or "reality"
    markers: tuple[str, ...]
    fps: float
    px_per_m: float
    warmup_s: float
    tracker: Tracker
    coefficients: tuple[float, ...] | None  # true coefficients; None where another simulator swam
    trials: list[Recording]
    varied: float = 0.0  # share by which the camera's frame times vary
    scale_factor: float = 1.0  # ratio of the scale length as written to the true one
    refusable: bool = False  # whether an error that says what is wrong with it is right
    refused: bool = False  # whether nothing but such an error is right
    disturbances: list[str] = field(default_factory=list)

    @property
    def tail(self) -> list[int]:
        """Indices of the markers behind the head, from head to fin."""
        behind = [i for i, name in enumerate(self.markers) if self.robot.markers[name].body != "head"]
        return sorted(behind, key=lambda i: self.robot.markers[self.markers[i]].position_m[0])

    @property
    def head(self) -> tuple[int, int]:
        """Indices of nose and neck."""
        return self.markers.index("nose"), self.markers.index("neck")

    @property
    def swims(self) -> list[Recording]:
        """The trials in water."""
        return [trial for trial in self.trials if trial.kind == "swim"]

    def write(self, folder: Path) -> None:
        """Write the session folder."""
        (folder / "trials").mkdir(parents=True)
        camera = {"fps": self.fps, "scale_length_m": round(self.scale_factor * self.robot.scale_length_m, 9)}
        content: dict = {"session": {"name": folder.name}, "camera": camera, "markers": {"names": list(self.markers)}}
        content |= {
            "fit": {"warmup_s": self.warmup_s},
            "trial": [_write_trial(folder, self, each) for each in self.trials],
        }
        if not self.built_in:
            (folder / "robot.toml").write_text(tomlkit.dumps(self.robot.model_dump(exclude_defaults=True)))
            content["robot"] = {"file": "robot.toml"}
        (folder / "session.toml").write_text(tomlkit.dumps(content))
        (folder / "disturbances.json").write_text(json.dumps(self.disturbances, indent=1) + "\n")


def _write_trial(folder: Path, session: Recordings, trial: Recording) -> dict:
    """Write the files of a trial; return its table in session.toml."""
    lines = ["time_s," + ",".join(f"{name}_x,{name}_y,{name}_confidence" for name in session.markers)]
    for time, xy, sure in zip(trial.time_s, trial.xy, trial.sure, strict=True):
        cells = (
            f"{x:.3f},{y:.3f},{_format_cell(c)}" if np.isfinite(x) else ",," for (x, y), c in zip(xy, sure, strict=True)
        )
        lines.append(f"{time:.6f}," + ",".join(cells))
    (folder / f"trials/{trial.name}.csv").write_text("\n".join(lines) + "\n")
    table = {"name": trial.name, "kind": trial.kind, "role": trial.role, "tracks": f"trials/{trial.name}.csv"}
    if trial.log is not None:
        save_motor_log(folder / f"trials/{trial.name}.motor.csv", trial.log[0])
        save_commands(folder / f"trials/{trial.name}.commands.csv", trial.log[1])
        table["motor"] = f"trials/{trial.name}.motor.csv"
    return table if trial.commanded_hz is None else table | {"commanded_hz": round(trial.commanded_hz, 4)}


def _format_cell(value: float) -> str:
    return f"{value:g}" if np.isfinite(value) else ""
