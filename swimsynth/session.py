"""A synthetic session on disk: tracks as a camera sees them, and the truth behind them.

`make_session` makes it: the twin moves, a camera and a faulty tracker look on, and the `Recorder` writes what camera,
tracker and motor record of each trial.

The `Truth` is kept in `truth.json`, next to `session.toml`. The program never reads it: it is there for whoever judges
a result. It holds the plan whole, so that the session can be made again from it, and what came of the plan in the
simulation.
"""

import gzip
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

import mujoco
import numpy as np
import tomlkit
import xarray as xr

from swimcal.create_session import new_folder, write_session_toml
from swimcal.mjcf import natural_hz
from swimcal.results import write_whole
from swimcal.session import load_session
from swimcal.toml import TomlTable
from swimcal.tracks import as_tracks, save_tracks
from swimsynth.disturbances import NOISELESS, Stream, lasting_errors, on_grid, placement_offsets
from swimsynth.plan import Pixels, PlannedTrial, SyntheticPlan, SyntheticTrial
from swimsynth.simulate import (
    TrueDecay,
    TrueRun,
    save_commands,
    save_motor_log,
    simulate_decays,
    simulate_dry_runs,
    simulate_swims,
)

TRUTH_FILE = "truth.json"

Progress = Callable[[str, int, int], None]
"""A function that is called with a trial's name, the number of frames done, and the number of all."""
_DECIMALS_PX = 2
_DECIMALS_S = 6

ROBOT_FILE = "robot.toml"


class DryTruth(TomlTable):
    """The outcome of one planned dry run.

    Attributes:
        frequency_hz: mean turns a second of the simulated crank between the first and the last frame; of the steady
            stretch where a motor is logged.
        phase_rad: crank angle in the first frame, from 0 to 2 pi.
        placement_px: offset between the box and its marker, by marker, x to the right and y down.
        steady_s: from when to when a logged motor turned steadily, on the clock of the video; None without a log.
    """

    frequency_hz: float
    phase_rad: float
    placement_px: dict[str, Pixels]
    steady_s: tuple[float, float] | None = None


class TrialTruth(DryTruth):
    """The outcome of one planned swim.

    Attributes:
        speed_m_s: forward speed of the nose (published normaliser) without noise: slope over the whole beats after the
            warm-up, or of the steady stretch.
    """

    speed_m_s: float


class DecayTruth(TomlTable):
    """The outcome of one planned free decay."""

    placement_px: dict[str, Pixels]


class StructureTruth(TomlTable):
    """The numbers that dry experiments are to find: of each hinge (per rad), of the crank's arm and of the tail.

    `natural_hz` is the lowest natural frequency of the tail in air without tendons: small swings, no damping.
    """

    hinge_stiffness_n_m: float
    hinge_damping_n_m_s: float
    natural_hz: float
    crank_arm_m: float


class Truth(TomlTable):
    """Everything that is known about a synthetic session: its plan, and what came of it, by trial.

    `mujoco` is the version of the engine that made it.
    """

    mujoco: str
    plan: SyntheticPlan
    structure: StructureTruth
    trials: dict[str, TrialTruth]
    dry_runs: dict[str, DryTruth]
    free_decays: dict[str, DecayTruth]


def read_truth(folder: Path) -> Truth:
    """Read the `truth.json` of a synthetic session."""
    return Truth.model_validate_json((folder / TRUTH_FILE).read_bytes())


# The recorder.


class Filming(Protocol):
    """An object that films swim trials instead of tracking them; a renderer is in `benchmarks.video`."""

    def films(self, trial: str) -> bool:
        """Return whether a trial is filmed."""

    def film(self, folder: Path, number: int, swim: TrueRun, plan: SyntheticPlan, progress: Progress) -> dict[str, str]:
        """Write the video of a swim.

        Args:
            folder: the session folder.
            number: number of the swim among the swims.
            swim: the simulated swim.
            plan: the plan of the session.
            progress: called after each frame.

        Returns:
            The keys of its ``[[trial]]``, files relative to the folder.
        """


class Recorder:
    """A recorder of trials into a session folder, which returns the truth of each.

    Without `video` it writes tracks alone.
    """

    def __init__(self, folder: Path, plan: SyntheticPlan, video: Filming | None, progress: Progress) -> None:
        self._folder, self._plan, self._video, self._progress = folder, plan, video, progress
        self.recordings: dict[str, dict[str, str]] = {}

    def swim(self, number: int, swim: TrueRun) -> TrialTruth:
        """Record the swim of this number, and return its truth."""
        if self._video is not None and self._video.films(swim.trial.name):
            recording = self._video.film(self._folder, number, swim, self._plan, self._progress)
            self.recordings[swim.trial.name] = recording
            placement = _by_marker(self._plan, np.zeros((len(self._plan.markers), 2)))
        else:
            placement = self._track(swim.trial, swim.position_px, Stream.SWIM_TRACKER.of(self._plan.seed, number))
        return TrialTruth(**self._record_driven(swim, placement).model_dump(), speed_m_s=swim.speed_m_s)

    def dry_run(self, number: int, run: TrueRun) -> DryTruth:
        """Record the dry run of this number, and return its truth."""
        placement = self._track(run.trial, run.position_px, Stream.DRY_TRACKER.of(self._plan.seed, number))
        return self._record_driven(run, placement)

    def free_decay(self, number: int, decay: TrueDecay) -> DecayTruth:
        """Record the free decay of this number, and return its truth."""
        random = Stream.DECAY_TRACKER.of(self._plan.seed, number)
        return DecayTruth(placement_px=self._track(decay.trial, decay.position_px, random))

    def _record_driven(self, run: TrueRun, placement: dict[str, Pixels]) -> DryTruth:
        if run.motor is not None:
            save_motor_log(self._folder / motor_file(run.trial), run.motor.log)
            save_commands(self._folder / f"trials/{run.trial.name}.commands.csv", run.motor.commands)
        return DryTruth(
            frequency_hz=run.frequency_hz,
            phase_rad=run.phase_rad,
            placement_px=placement,
            steady_s=None if run.motor is None else run.motor.steady_s,
        )

    def _track(self, trial: PlannedTrial, position_px: np.ndarray, random: np.random.Generator) -> dict[str, Pixels]:
        tracks, offsets_px = track_as_filmed(trial, position_px, self._plan, random)
        file = f"trials/{trial.name}.csv.gz"
        save_packed_tracks(self._folder / file, tracks)
        self.recordings[trial.name] = {"tracks": file}
        return _by_marker(self._plan, offsets_px)


def track_as_filmed(
    trial: PlannedTrial, position_px: np.ndarray, plan: SyntheticPlan, random: np.random.Generator
) -> tuple[xr.Dataset, np.ndarray]:
    """Track a trial as a faulty tracker would.

    Args:
        trial: the planned trial, with its track faults.
        position_px: (n, m, 2) true markers in the image.
        plan: the plan of the session.
        random: draws the errors.

    Returns:
        The tracks, and the (m, 2) offsets of the boxes from their markers, px.
    """
    noise = plan.noise
    offsets_px = placement_offsets(len(plan.markers), noise, random)
    place_m = plan.swimmer.marker_positions_m(plan.markers)[:, 0]
    errors_px = lasting_errors(position_px.shape, 1 / plan.camera.fps, noise, random, place_m)
    boxes_px = position_px + offsets_px + errors_px
    for fault in trial.faults:
        fault.apply(boxes_px, plan.markers)
    found_px = np.round(on_grid(boxes_px, noise), _DECIMALS_PX)
    confidence = np.isfinite(found_px).all(axis=2).astype(float)
    return as_tracks(plan.markers, np.round(trial.time_s(plan.camera), _DECIMALS_S), found_px, confidence), offsets_px


def motor_file(trial: SyntheticTrial) -> str:
    """Return the name of a trial's motor log in the session folder."""
    return f"trials/{trial.name}.motor.csv"


def _by_marker(plan: SyntheticPlan, offsets_px: np.ndarray) -> dict[str, Pixels]:
    offsets = [(round(float(x), 3), round(float(y), 3)) for x, y in offsets_px]
    return dict(zip(plan.markers, offsets, strict=True))


def save_packed_tracks(path: Path, tracks: xr.Dataset) -> None:
    """Write tracks as .csv.gz without name or time of the file, so that the same tracks give the same bytes."""
    plain = path.with_suffix("")
    save_tracks(plain, tracks)
    write_whole(path, gzip.compress(plain.read_bytes(), mtime=0))
    plain.unlink()


def make_session(
    folder: Path, plan: SyntheticPlan, video: Filming | None = None, progress: Progress = lambda *_: None
) -> Path:
    """Make a session folder with known truth: `session.toml`, packed tracks or videos, motor logs, `truth.json`.

    The motion comes from the twin at a finer time step than a fit uses; a swim without a motor begins in the middle of
    a developed one. Each trial draws from streams of its own, so that changing one leaves the others as they are. The
    same plan gives the same bytes on the same engine.

    A filmed swim has `trials/<name>.mp4`, start boxes next to it, and what a perfect tracker would find as
    `truth/<name>.csv`. The plan's noise and faults, which are a tracker's, do not apply to it.

    A trial with a motor has `trials/<name>.motor.csv` and `trials/<name>.commands.csv`, as from `calib capture`. The
    offset between the motor's clock and that of the video is in the truth alone.

    Args:
        folder: the folder to make.
        plan: the plan of the session.
        video: films the swim trials for which it says so; a renderer is in `benchmarks.video`.
        progress: called after each frame of a video.

    Raises:
        swimcal.errors.InputError: the folder is not empty, or a trial leaves the image.
        ResultsNotWritable: the folder cannot be written.
        SimulationDiverged: the planned motion is unstable.
    """
    if video is not None:
        # Swims that are filmed have no errors of a tracker.
        trials = tuple(t.model_copy(update={"faults": ()}) if video.films(t.name) else t for t in plan.trials)
        tracked = plan.dry_runs or plan.free_decays or not all(video.films(trial.name) for trial in plan.trials)
        plan = plan.model_copy(update={"trials": trials, "noise": plan.noise if tracked else NOISELESS})
    with new_folder(folder) as part:
        recorder, robot = Recorder(part, plan, video, progress), plan.swimmer
        truth = Truth(
            mujoco=mujoco.__version__,
            plan=plan,
            structure=StructureTruth(
                hinge_stiffness_n_m=robot.tail.hinge_stiffness_n_m,
                hinge_damping_n_m_s=robot.tail.hinge_damping_n_m_s,
                natural_hz=natural_hz(robot),
                crank_arm_m=robot.crank.arm_m,
            ),
            trials={true.trial.name: recorder.swim(i, true) for i, true in enumerate(simulate_swims(plan))},
            dry_runs={true.trial.name: recorder.dry_run(i, true) for i, true in enumerate(simulate_dry_runs(plan))},
            free_decays={true.trial.name: recorder.free_decay(i, true) for i, true in enumerate(simulate_decays(plan))},
        )
        _write_description(part, plan, recorder.recordings)
        write_whole(part / TRUTH_FILE, truth.model_dump_json(indent=1) + "\n")
        load_session(part)
    return folder


def _write_description(folder: Path, plan: SyntheticPlan, recordings: Mapping[str, Mapping[str, str]]) -> None:
    if plan.robot is not None:
        write_whole(folder / ROBOT_FILE, tomlkit.dumps(plan.robot.model_dump()))
    write_session_toml(
        folder,
        name=plan.name,
        camera={"fps": plan.camera.fps, "scale_length_m": round(plan.swimmer.scale_length_m, 9)},
        markers=plan.markers,
        trials=list(_trial_tables(plan, recordings)),
        fit={"warmup_s": plan.warmup_s},
        robot_file=None if plan.robot is None else ROBOT_FILE,
    )


def _trial_tables(plan: SyntheticPlan, recordings: Mapping[str, Mapping[str, str]]) -> Iterator[dict[str, Any]]:
    """Yield the keys of each `[[trial]]`; None leaves a key out."""
    for kind, trials in (("swim", plan.trials), ("dry", plan.dry_runs)):
        for trial in trials:
            motor = None if trial.motor is None else motor_file(trial)
            driven = {"motor": motor, "commanded_hz": trial.commanded_hz, "role": trial.role}
            yield {"name": trial.name, "kind": kind, **recordings[trial.name], **driven}
    for decay in plan.free_decays:
        yield {"name": decay.name, "kind": "free_decay", **recordings[decay.name], "role": decay.role}
